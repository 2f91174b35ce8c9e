// Tables and pictures for people: one page of HTML without any other file, and Markdown.
#pragma once

#include <string>
#include <vector>

#include "accuracy/figures.hpp"
#include "accuracy/png.hpp"

namespace meniscus::accuracy {

/// A number that is measured, as a table shows it.
struct Quantity {
  std::string name, unit;
  int digits = 0;  // behind the point
  Better better = Better::low;
  std::string meaning;  // a plain sentence
};

/// Quantities down, columns (methods) across.
struct Table {
  struct Line {
    Quantity quantity;
    std::vector<double> values;        // one a column; NaN: not measured
    std::vector<std::string> worst{};  // of what a value is the mean of, and where; may be empty
  };
  std::string title, note;  // the note may be empty
  std::vector<std::string> columns;
  std::vector<Line> lines;
  std::string heading = "figure";  // what the lines are
};

/// Pictures side by side: rows (scenes) down, columns (methods) across.
struct Gallery {
  struct Cell {
    std::string caption;
    Bytes first, second;  // PNGs; the page switches between the two
  };
  struct Row {
    std::string name;
    std::vector<Cell> cells;
  };
  std::string title, note;
  std::string first_kind, second_kind;  // what the two pictures of a cell are
  std::vector<Row> rows;
};

struct Report {
  std::string title, introduction;
  std::vector<std::pair<std::string, std::string>> facts;  // device, seeds ...
  std::vector<Table> tables;                               // shown at once
  std::vector<Gallery> galleries;
  std::vector<Table> details;  // shown on demand
  bool error_legend = false;   // explain the colours of error maps
};

/// The value with its digits, or a dash.
std::string shown(const Quantity& quantity, double value);

/// Which values of a line are best, to the digits shown. None when there is no choice.
std::vector<bool> best_of(const Table::Line& line);

/// The tables (not the details), best values in bold, the worst behind a mean in brackets.
std::string markdown(const Report& report);

std::string html(const Report& report);

}  // namespace meniscus::accuracy
