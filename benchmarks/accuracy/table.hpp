// A table of figures on the terminal: a row for each mesh or map, and one for what they come to.
#pragma once

#include <cmath>
#include <cstdio>
#include <span>
#include <string>
#include <vector>

namespace meniscus::accuracy {

/// What the last row has of a column.
enum class Over {
  all,        // the mean
  known,      // the mean of those that are not NaN
  magnitude,  // the mean of absolute values
  total       // the sum
};

template <class Row>
struct Column {
  const char* title;
  int width, digits;
  double (*value)(const Row&);  // NaN: there is none
  Over over = Over::all;
};

template <class Row>
void print_head(const std::string& labels, std::span<const Column<Row>> columns) {
  std::fputs(labels.c_str(), stdout);
  for (const Column<Row>& column : columns) std::printf(" %*s", column.width, column.title);
  std::puts("");
}

template <class Row>
void print_values(const std::string& labels, std::span<const Column<Row>> columns,
                  const std::vector<double>& values) {
  std::fputs(labels.c_str(), stdout);
  for (std::size_t k = 0; k < columns.size(); ++k)
    if (std::isnan(values[k]))
      std::printf(" %*s", columns[k].width, "-");
    else
      std::printf(" %*.*f", columns[k].width, columns[k].digits, values[k]);
  std::puts("");
  std::fflush(stdout);
}

template <class Row>
void print_row(const std::string& labels, std::span<const Column<Row>> columns, const Row& row) {
  std::vector<double> values;
  for (const Column<Row>& column : columns) values.push_back(column.value(row));
  print_values(labels, columns, values);
}

/// What the rows of a table come to; `rows` is not empty.
template <class Row>
std::vector<double> values_over(std::span<const Column<Row>> columns,
                                const std::vector<Row>& rows) {
  std::vector<double> values;
  for (const Column<Row>& column : columns) {
    double sum = 0, count = 0;
    for (const Row& row : rows) {
      const double value = column.value(row);
      if (column.over == Over::known && std::isnan(value)) continue;
      sum += column.over == Over::magnitude ? std::abs(value) : value;
      ++count;
    }
    values.push_back(column.over == Over::total ? sum : sum / count);
  }
  return values;
}

}  // namespace meniscus::accuracy
