// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "symkin/support/types.hpp"

namespace symkin {

struct CsvNumber {
  double value;
  char mark;  // of the decimals, or 0
};

// What a cell says, without spaces around it: digits, a mark, an exponent, or a word for what is
// not finite. Nothing else is a number; a comma is a mark where it does not separate cells.
std::optional<CsvNumber> csv_number(std::string_view cell, bool with_commas);

// The shortest digits that read back to the same double, as Python writes them but for a ".0"
// behind whole numbers; empty for NaN.
std::string csv_cell(double value);

// A column as numbers, NaN where a cell is empty or holds something else.
struct CsvColumn {
  std::string name;
  Vector numbers;
  Eigen::Array<bool, Eigen::Dynamic, 1> empty;
  // The first rows that hold text, a decimal point, a decimal comma; or -1.
  Index text = -1;
  Index point = -1;
  Index comma = -1;
};

// A column as words: for each row the place of its word among those that differ, -1 for none.
struct CsvWords {
  Eigen::VectorXi codes;
  std::vector<std::string> distinct;
};

// What a text is of a file: all, or its header and some of its rows.
struct CsvPart {
  Index passed = 0;  // lines of the file between the header and these rows
  bool last = true;  // else more follows, and what reaches the text's end is not read yet
};

// CSV with a row of names, separated by what occurs most often there: commas, semicolons or tabs.
// Lines of `#`, empty lines and rows of empty cells are passed over; quotes are those of RFC 4180,
// also after spaces. The text is not copied, so it outlives the table.
class CsvTable {
 public:
  // Throws InvalidInput with the line of what cannot be read.
  explicit CsvTable(std::string_view text, CsvPart part = {});

  const std::vector<CsvColumn>& columns() const { return columns_; }
  // Where the header ends in the text, and how many lines it has with those above.
  std::size_t header_size() const { return header_size_; }
  Index header_lines() const { return header_lines_; }
  // Where a row begins in the text.
  std::size_t start(Index row) const { return starts_.at(static_cast<std::size_t>(row)); }
  // From which row on all have the same in a column; 0 if there is none.
  Index last_run(Index column) const;
  // Forgets all rows but the first.
  void keep(Index rows);
  // Where the rows begin, counted from 1.
  const std::vector<Index>& lines() const { return lines_; }
  Index row_count() const { return static_cast<Index>(lines_.size()); }
  // Whether a comma may be a decimal mark.
  bool with_commas() const { return separator_ != ','; }
  std::string cell(Index row, Index column) const;
  CsvWords words(Index column) const;

 private:
  std::string_view text_;
  char separator_;
  std::vector<CsvColumn> columns_;
  std::size_t header_size_ = 0;
  Index header_lines_ = 0;
  std::vector<std::size_t> starts_;
  std::vector<Index> lines_;
};

}  // namespace symkin
