#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/attribute_names.hpp"
#include "io/fields.hpp"
#include "io/readers.hpp"
#include "io/text_cursor.hpp"

namespace meniscus {
namespace {

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

std::optional<double> real_of(std::string_view word, bool decimal_comma) {
  const std::size_t comma = decimal_comma ? word.find(',') : std::string_view::npos;
  if (comma == std::string_view::npos) return parse_real(word);
  std::string with_point(word);
  with_point[comma] = '.';
  return parse_real(with_point);
}

/// Where the text begins: behind the byte order mark that some editors write.
std::size_t start_of(const InputFile& file) {
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
  return file.bytes.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0;
}

// .csv

/// Splits a row; a cell in double quotes may hold the separator, and "" for a quote. Returns what
/// is wrong with such cells, in words; empty: nothing.
std::string split_cells(std::string_view line, char separator, Words& cells) {
  cells.clear();
  for (std::size_t at = 0;;) {
    const std::size_t first = std::min(line.find_first_not_of(" ", at), line.size());
    std::size_t end;
    if (first < line.size() && line[first] == '"') {
      std::size_t close = line.find('"', first + 1);
      while (close != std::string_view::npos && line.substr(close + 1).starts_with('"'))
        close = line.find('"', close + 2);
      if (close == std::string_view::npos)
        return "a cell in quotes does not end in its line, wanted one line for each row";
      cells.push_back(line.substr(first + 1, close - first - 1));
      end = std::min(line.find(separator, close), line.size());
      if (const auto rest = trimmed(line.substr(close + 1, end - close - 1)); !rest.empty())
        return "found " + in_quotes(rest) + " after a cell in quotes, wanted a separator";
    } else {
      end = std::min(line.find(separator, at), line.size());
      cells.push_back(trimmed(line.substr(at, end - at)));
    }
    if (end == line.size()) return "";
    at = end + 1;
  }
}

/// The one of comma, semicolon and tab that splits the line into most cells.
char separator_of(std::string_view line) {
  char best = ',';
  std::size_t most = 0;
  Words cells;
  for (const char separator : {';', ',', '\t'}) {  // 0,5;1;2 has a decimal comma
    split_cells(line, separator, cells);
    if (cells.size() > most) {
      most = cells.size();
      best = separator;
    }
  }
  return best;
}

/// Names of the columns of a table without a header row.
std::vector<std::string> default_names(std::size_t columns) {
  std::vector<std::string> names = {"x", "y", "z"};
  if (columns == 6) names.insert(names.end(), {"vx", "vy", "vz"});
  names.resize(columns);
  return names;
}

/// The next line that is neither blank nor a comment.
std::optional<std::string_view> next_row(TextCursor& cursor) {
  while (const auto line = cursor.next_line())
    if (!trimmed(*line).empty() && !line->starts_with('#')) return line;
  return std::nullopt;
}

/// How a table is to be read.
struct Table {
  char separator;
  std::vector<std::string> names;  // of its columns
  bool has_header;                 // that says them; else they are the usual ones

  bool has_decimal_comma() const { return separator == ';'; }

  void split(const InputFile& file, const TextCursor& cursor, std::string_view row,
             Words& cells) const {
    if (const std::string flaw = split_cells(row, separator, cells); !flaw.empty())
      fail(file, cursor.place(), flaw);
  }
};

/// Finds the row of names, or of the first values where there are no names; `cells` become that
/// row's. DualSPHysics writes lines about the file before the names, of numbers, too.
Table find_table(const InputFile& file, TextCursor& cursor, Words& cells) {
  constexpr int kMostBefore = 16;  // lines
  int before = 0;
  std::string first;  // what is wrong with the first of them
  while (const auto row = next_row(cursor)) {
    Table table{separator_of(*row), {}, false};
    table.split(file, cursor, *row, cells);
    table.has_header = !std::all_of(cells.begin(), cells.end(), [&](std::string_view cell) {
      return real_of(cell, table.has_decimal_comma()).has_value();
    });
    if (table.has_header)
      table.names.assign(cells.begin(), cells.end());
    else
      table.names = default_names(cells.size());
    const std::string missing = missing_coordinate(fields_of_columns(table.names));
    if (missing.empty() && (table.has_header || before == 0)) {
      if (table.has_header && !cursor.line_was_ended())
        fail(file, cursor.place(), "the file ends in the row of names (truncated?)");
      return table;
    }
    if (before == 0)
      first = cursor.place() + ": found " + in_quotes(*row) + " without a column " + missing +
              ", wanted columns x, y, z separated by comma, semicolon or tab";
    if (++before > kMostBefore) break;
  }
  if (before > 0) throw InputError(file.name + ": " + first);
  fail(file, "", "has no rows, wanted columns x, y, z");
}

// .xyz

/// How the rows of a file are to be read.
struct Rows {
  std::size_t columns = 0;
  std::size_t label = 0;  // 1: the first column is the element of a chemist's file
  bool has_velocity = false;
};

Rows rows_like(const InputFile& file, const TextCursor& cursor, const Words& first) {
  const std::size_t columns = first.size();
  if (columns < 3)
    fail(file, cursor.place(),
         "found " + std::to_string(columns) + " columns, wanted at least 3: x y z");
  const std::size_t label = columns > 3 && !parse_real(first[0]) ? 1 : 0;
  return {columns, label, columns - label == 6};
}

/// The count of the first line, which a line of comment follows.
std::size_t read_count(const InputFile& file, TextCursor& cursor, std::string_view word) {
  const auto count = parse_integer(word);
  if (!count || *count < 0)
    fail(file, cursor.place(),
         "found " + in_quotes(word) + ", wanted x y z or the number of particles");
  if (!cursor.line_was_ended() || !cursor.next_line() || !cursor.line_was_ended())
    fail(file, cursor.place(), "the file ends here, wanted a comment line after the count");
  return static_cast<std::size_t>(*count);
}

/// Checks that all rows have been read.
void check_end(const InputFile& file, const TextCursor& cursor, std::optional<std::size_t> stated,
               std::size_t rows) {
  if (!stated && rows == 0 && !cursor.line_was_ended())
    fail(file, cursor.place(),
         "the file ends in a comment (truncated? if it has no particles, end it with a new line)");
  if (stated && rows < *stated)
    fail(file, cursor.place(),
         "the file ends after " + std::to_string(rows) + " rows, wanted " +
             std::to_string(*stated) + " as the first line states (truncated?)");
  if (stated && *stated > 0) cursor.require_line_end();
}

}  // namespace

Particles read_xyz(const InputFile& file, const ReadOptions& options) {
  if (!options.attributes.empty())
    fail(file, "",
         "has no attribute " + in_quotes(options.attributes[0]) +
             ": columns of .xyz have no names (save it as .csv)");
  TextCursor cursor(file, start_of(file));
  Particles particles;
  Words words;
  std::optional<std::size_t> stated;  // the count of the first line
  Rows rows;
  while (const auto line = cursor.next_line()) {
    split_at_blanks(line->substr(0, line->find('#')), words);
    if (words.empty()) continue;
    if (rows.columns == 0 && words.size() == 1 && !stated) {
      stated = read_count(file, cursor, words[0]);
      continue;
    }
    if (rows.columns == 0) rows = rows_like(file, cursor, words);
    if (words.size() != rows.columns)
      fail(file, cursor.place(),
           "found " + std::to_string(words.size()) + " columns, wanted " +
               std::to_string(rows.columns) + " as in the first row (truncated?)");
    if (stated && particles.size() == *stated)
      fail(file, cursor.place(),
           "found more rows than the " + std::to_string(*stated) +
               " that the first line states, wanted one frame");
    const auto value = [&](std::size_t k, const char* column) {
      return static_cast<float>(cursor.real_of(words[rows.label + k], column));
    };
    particles.x.push_back(value(0, "x"));
    particles.y.push_back(value(1, "y"));
    particles.z.push_back(value(2, "z"));
    if (!rows.has_velocity) continue;
    particles.vx.push_back(value(3, "vx"));
    particles.vy.push_back(value(4, "vy"));
    particles.vz.push_back(value(5, "vz"));
  }
  check_end(file, cursor, stated, particles.size());
  return particles;
}

Particles read_csv(const InputFile& file, const ReadOptions& options) {
  TextCursor cursor(file, start_of(file));
  Words cells;
  const Table table = find_table(file, cursor, cells);
  const std::vector<Field> fields = fields_of_columns(table.names);
  const auto picks = pick_attributes(file.name, table.names, options.attributes);

  Particles particles;
  for (const AttributePick& pick : picks) particles.attributes.push_back({pick.name, {}});
  const auto add_row = [&] {
    if (cells.size() != fields.size())
      fail(file, cursor.place(),
           "found " + std::to_string(cells.size()) + " columns, wanted " +
               std::to_string(fields.size()) + " as in the first row (truncated?)");
    const auto value = [&](std::size_t k) {
      const std::optional<double> number = real_of(cells[k], table.has_decimal_comma());
      if (!number)
        fail(file, cursor.place(),
             "found " + in_quotes(cells[k]) + ", wanted a number for " + shown(table.names[k]));
      return static_cast<float>(*number);
    };
    for (std::size_t k = 0; k < cells.size(); ++k) {
      if (fields[k] == Field::id)
        particles.id.push_back(cursor.integer_of(cells[k], "id"));
      else if (fields[k] != Field::none)
        array_of(particles, fields[k]).push_back(value(k));
    }
    for (std::size_t a = 0; a < picks.size(); ++a)
      particles.attributes[a].values.push_back(value(picks[a].array));
  };
  if (!table.has_header) add_row();
  while (const auto row = next_row(cursor)) {
    table.split(file, cursor, *row, cells);
    add_row();
  }
  return particles;
}

}  // namespace meniscus
