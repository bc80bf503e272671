// SPDX-License-Identifier: MIT
#include "symkin/support/csv_table.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <locale>
#include <sstream>
#include <string>
#include <unordered_map>

#include "symkin/support/error.hpp"
#include "symkin/support/interrupt.hpp"

#if defined(__cpp_lib_to_chars) || (defined(_LIBCPP_VERSION) && _LIBCPP_VERSION >= 200000)
#define SYMKIN_READS_DOUBLES
#endif

namespace symkin {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
// A quote that is not closed would make one cell of all the rest.
constexpr std::size_t kMostCharacters = 131072;
constexpr std::size_t kUsualCharacters = 32;  // of a number
constexpr Index kRowsPerInterrupt = 65536;
// Powers of ten between which Python writes numbers without them.
constexpr int kLeastPlain = -4;
constexpr int kMostPlain = 16;

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_end_of_line(char c) { return c == '\n' || c == '\r'; }
bool is_blank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
bool is_no_text(char c) { return static_cast<unsigned char>(c) < 32 && (c < '\t' || c > '\r'); }

std::string_view stripped(std::string_view cell) {
  while (!cell.empty() && is_blank(cell.front())) {
    cell.remove_prefix(1);
  }
  while (!cell.empty() && is_blank(cell.back())) {
    cell.remove_suffix(1);
  }
  return cell;
}

// Of decimal digits with a point alone, whose form is known; null where no double is near.
const char* read_double(const char* begin, const char* end, double& value) {
#ifdef SYMKIN_READS_DOUBLES
  const auto [stop, error] = std::from_chars(begin, end, value);
  return error == std::errc() ? stop : nullptr;
#else
  std::istringstream stream(std::string(begin, end));
  stream.imbue(std::locale::classic());
  return stream >> value && stream.eof() ? end : nullptr;
#endif
}

std::optional<double> not_finite(std::string_view word, bool negative) {
  std::string lower(word);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  if (lower == "nan") {
    return kNaN;
  }
  if (lower == "inf" || lower == "infinity") {
    return negative ? -kInfinity : kInfinity;
  }
  return std::nullopt;
}

// The places of a number's parts.
struct Form {
  std::size_t whole = 0;  // digits before the mark
  std::size_t decimals = 0;
  std::size_t zeros = 0;  // of these digits, before the first that is none
  char mark = 0;
  bool is_small = false;  // its exponent is negative
};

std::optional<Form> form_of(std::string_view digits, bool with_commas) {
  Form form;
  std::size_t at = 0;
  bool all_zero = true;
  const auto pass_digits = [&] {
    std::size_t count = 0;
    for (; at < digits.size() && is_digit(digits[at]); ++at, ++count) {
      all_zero = all_zero && digits[at] == '0';
      form.zeros += all_zero ? 1U : 0U;
    }
    return count;
  };
  form.whole = pass_digits();
  if (at < digits.size() && (digits[at] == '.' || (with_commas && digits[at] == ','))) {
    form.mark = digits[at++];
    form.decimals = pass_digits();
  }
  if (form.whole + form.decimals == 0) {
    return std::nullopt;
  }
  if (at < digits.size() && (digits[at] == 'e' || digits[at] == 'E')) {
    ++at;
    form.is_small = at < digits.size() && digits[at] == '-';
    at += at < digits.size() && (digits[at] == '-' || digits[at] == '+') ? 1U : 0U;
    const std::size_t first = at;
    pass_digits();
    if (at == first) {
      return std::nullopt;
    }
  }
  return at == digits.size() ? std::optional(form) : std::nullopt;
}

}  // namespace

std::optional<CsvNumber> csv_number(std::string_view cell, bool with_commas) {
  const bool negative = !cell.empty() && cell.front() == '-';
  if (negative || (!cell.empty() && cell.front() == '+')) {
    cell.remove_prefix(1);
  }
  const std::optional<Form> form = form_of(cell, with_commas);
  if (!form) {
    const std::optional<double> word = not_finite(cell, negative);
    return word ? std::optional(CsvNumber{*word, 0}) : std::nullopt;
  }
  std::string pointed;
  if (form->mark == ',') {
    pointed = cell;
    pointed[form->whole] = '.';
    cell = pointed;
  }
  double size = 0.0;
  if (read_double(cell.data(), cell.data() + cell.size(), size) == nullptr) {
    // Beyond the range of a double: far above 1 or far below, whichever its digits say.
    const bool tiny = form->is_small || form->zeros >= std::max<std::size_t>(form->whole, 1);
    size = tiny ? 0.0 : kInfinity;
  }
  return CsvNumber{negative ? -size : size, form->mark};
}

std::string csv_cell(double value) {
  if (!std::isfinite(value)) {
    return std::isnan(value) ? "" : value < 0 ? "-inf" : "inf";
  }
  std::array<char, kUsualCharacters> written;  // NOLINT(cppcoreguidelines-pro-type-member-init)
  const char* const begin = written.data();
  const char* const end = std::to_chars(written.data(), written.data() + written.size(),
                                        std::abs(value), std::chars_format::scientific)
                              .ptr;
  // A digit, further ones behind a point, and the power of ten of the first.
  const char* const power = std::find(begin, end, 'e');
  const std::string_view more =
      power - begin > 2 ? std::string_view(begin + 2, static_cast<std::size_t>(power - begin - 2))
                        : std::string_view();
  int exponent = 0;
  std::from_chars(power + (power[1] == '+' ? 2 : 1), end, exponent);
  std::string cell(std::signbit(value) ? "-" : "");
  const auto behind = static_cast<std::size_t>(std::abs(exponent));
  if (exponent < kLeastPlain || exponent >= kMostPlain) {
    return cell.append(begin, end);
  }
  if (exponent < 0) {
    return cell.append("0.").append(behind - 1, '0').append(1, *begin).append(more);
  }
  cell.append(1, *begin);
  if (more.size() <= behind) {
    return cell.append(more).append(behind - more.size(), '0');
  }
  return cell.append(more.substr(0, behind)).append(".").append(more.substr(behind));
}

namespace {

// Goes through a text cell by cell.
class Reader {
 public:
  Reader(std::string_view text, char separator)
      : at_(text.data()), end_(text.data() + text.size()), separator_(separator) {}

  bool is_at_end() const { return at_ == end_; }
  Index line() const { return line_; }
  const char* place() const { return at_; }
  void go_to(const char* place) { at_ = place; }

  // To the next record: past empty lines and comments.
  bool next_record() {
    while (at_ != end_) {
      const char* first =
          std::find_if(at_, end_, [](char c) { return !is_blank(c) || is_end_of_line(c); });
      if (first != end_ && *first != '#' && !is_end_of_line(*first)) {
        return true;
      }
      at_ = std::find_if(first, end_, is_end_of_line);
      pass_end_of_line();
    }
    return false;
  }

  // A number that a separator or the line's end follows, which most cells are.
  std::optional<CsvNumber> plain_number() {
    const char* first = at_;
    while (first != end_ && *first == ' ') {
      ++first;
    }
    const char* digits = first != end_ && *first == '-' ? first + 1 : first;
    if (digits == end_ || !is_digit(*digits)) {
      return std::nullopt;
    }
#ifdef SYMKIN_READS_DOUBLES
    CsvNumber found{0.0, 0};
    const auto [stop, error] = std::from_chars(first, end_, found.value);
    if (error == std::errc() && (stop == end_ || *stop == separator_ || is_end_of_line(*stop))) {
      found.mark = std::find(first, stop, '.') == stop ? '\0' : '.';
      at_ = stop;
      return found;
    }
#endif
    std::array<char, kUsualCharacters> copy;  // NOLINT(cppcoreguidelines-pro-type-member-init)
    char* last = copy.data();
    CsvNumber number{0.0, 0};
    for (; first != end_ && *first != separator_ && !is_end_of_line(*first); ++first, ++last) {
      const bool is_mark = *first == '.' || *first == ',';
      if (last == copy.data() + copy.size() || (is_mark && number.mark != 0)) {
        return std::nullopt;
      }
      number.mark = is_mark ? *first : number.mark;
      *last = is_mark ? '.' : *first;
    }
    if (read_double(copy.data(), last, number.value) != last) {
      return std::nullopt;
    }
    at_ = first;
    return number;
  }

  // Any cell, without spaces around it. It holds until the next one is read.
  std::string_view cell() {
    const Index line = line_;
    if (separator_ != '\t') {
      while (at_ != end_ && *at_ == ' ') {
        ++at_;
      }
    }
    const char* first = at_;
    if (at_ == end_ || *at_ != '"') {
      at_ =
          std::find_if(at_, end_, [this](char c) { return c == separator_ || is_end_of_line(c); });
      check_size(static_cast<std::size_t>(at_ - first), line);
      return stripped({first, static_cast<std::size_t>(at_ - first)});
    }
    quoted_.clear();
    bool inside = true;
    for (++at_; at_ != end_ && (inside || (*at_ != separator_ && !is_end_of_line(*at_)));) {
      pass_quoted(inside);
      check_size(quoted_.size(), line);
    }
    return stripped(quoted_);
  }

  // Past what follows a cell; whether another one of the record does.
  bool next_cell() {
    if (at_ != end_ && *at_ == separator_) {
      ++at_;
      return true;
    }
    pass_end_of_line();
    return false;
  }

 private:
  void pass_end_of_line() {
    if (at_ == end_) {
      return;
    }
    const bool two = *at_ == '\r' && at_ + 1 != end_ && at_[1] == '\n';
    at_ += two ? 2 : 1;
    ++line_;
  }

  // A character of a cell that began with a quote; quotes that do not close it stand for
  // themselves.
  void pass_quoted(bool& inside) {
    if (is_end_of_line(*at_)) {
      pass_end_of_line();
      quoted_ += '\n';
      return;
    }
    const bool two = inside && *at_ == '"' && at_ + 1 != end_ && at_[1] == '"';
    if (inside && *at_ == '"' && !two) {
      inside = false;
    } else {
      quoted_ += *at_;
    }
    at_ += two ? 2 : 1;
  }

  static void check_size(std::size_t size, Index line) {
    if (size > kMostCharacters) {
      throw InvalidInput("row " + std::to_string(line) + " cannot be read: a cell has more than " +
                         std::to_string(kMostCharacters) + " characters");
    }
  }

  const char* at_;
  const char* end_;
  char separator_;
  Index line_ = 1;
  std::string quoted_;
};

void refuse_what_is_no_text(std::string_view text, std::size_t header, Index passed) {
  // Counted first, which is quick: nearly always there is none.
  std::size_t strange = 0;
  for (const char c : text) {
    strange += is_no_text(c) ? 1U : 0U;
  }
  if (strange == 0) {
    return;
  }
  const auto* at = std::find_if(text.begin(), text.end(), is_no_text);
  const bool in_header = static_cast<std::size_t>(at - text.begin()) < header;
  const auto row = std::count(text.begin(), at, '\n') + 1 + (in_header ? 0 : passed);
  constexpr std::string_view kDigits = "0123456789abcdef";
  const auto code = static_cast<unsigned char>(*at);
  throw InvalidInput("cannot be read: row " + std::to_string(row) + " has a character '\\x" +
                     kDigits[code / 16U] + kDigits[code % 16U] + "'; expected text");
}

// What separates the names, outside of quotes, most often.
char separator_of(std::string_view text) {
  Reader reader(text, ',');
  reader.next_record();
  constexpr std::string_view kSeparators = ",;\t";
  std::array<int, kSeparators.size()> counts{};
  bool inside = false;
  for (const char* at = reader.place(); at != text.data() + text.size() && !is_end_of_line(*at);
       ++at) {
    inside = inside != (*at == '"');
    const std::size_t which = kSeparators.find(*at);
    if (!inside && which != std::string_view::npos) {
      ++counts[which];
    }
  }
  const auto* most = std::max_element(counts.begin(), counts.end());
  return kSeparators[static_cast<std::size_t>(most - counts.begin())];
}

void note_mark(char mark, Index row, CsvColumn& column) {
  Index& first = mark == ',' ? column.comma : column.point;
  first = first < 0 && mark != 0 ? row : first;
}

// A cell that is no plain number.
void take(std::string_view cell, bool with_commas, Index row, CsvColumn& column) {
  column.empty[row] = cell.empty();
  column.numbers[row] = kNaN;
  const std::optional<CsvNumber> number = csv_number(cell, with_commas);
  if (number) {
    column.numbers[row] = number->value;
    note_mark(number->mark, row, column);
  } else if (!cell.empty() && column.text < 0) {
    column.text = row;
  }
}

// The cells of a record into a row: how many there are, and whether all are empty.
std::pair<std::size_t, bool> take_record(Reader& reader, bool with_commas, Index row,
                                         std::vector<CsvColumn>& columns) {
  std::size_t cells = 0;
  bool all_empty = true;
  do {
    if (cells >= columns.size()) {
      all_empty = reader.cell().empty() && all_empty;
    } else if (const auto number = reader.plain_number()) {
      CsvColumn& column = columns[cells];
      column.numbers[row] = number->value;
      column.empty[row] = false;
      note_mark(number->mark, row, column);
      all_empty = false;
    } else {
      take(reader.cell(), with_commas, row, columns[cells]);
      all_empty = all_empty && columns[cells].empty[row];
    }
    ++cells;
  } while (reader.next_cell());
  return {cells, all_empty};
}

}  // namespace

CsvTable::CsvTable(std::string_view text, CsvPart part) : text_(text), separator_(',') {
  const bool has_more_before = part.passed > 0;
  if (!has_more_before) {
    refuse_what_is_no_text(text, text.size(), 0);
  }
  separator_ = separator_of(text);
  Reader reader(text, separator_);
  bool all_numbers = true;
  for (bool more = reader.next_record(); more; more = reader.next_cell()) {
    columns_.emplace_back().name = reader.cell();
    const std::optional<CsvNumber> number = csv_number(columns_.back().name, with_commas());
    all_numbers = all_numbers && number && std::isfinite(number->value);
  }
  header_size_ = static_cast<std::size_t>(reader.place() - text.data());
  header_lines_ = reader.line() - 1;
  if (has_more_before) {
    refuse_what_is_no_text(text, header_size_, part.passed);
  }
  // As many as there are lines: memory that nothing is written to costs nothing.
  const auto most = std::count_if(text.begin(), text.end(), is_end_of_line) + 1;
  for (CsvColumn& column : columns_) {
    column.numbers.resize(most);
    column.empty.resize(most);
  }
  starts_.reserve(static_cast<std::size_t>(most));
  lines_.reserve(static_cast<std::size_t>(most));
  while (reader.next_record()) {
    const Index line = reader.line() + part.passed;
    const auto start = static_cast<std::size_t>(reader.place() - text.data());
    const auto [cells, all_empty] = take_record(reader, with_commas(), row_count(), columns_);
    if (!part.last && reader.is_at_end()) {
      break;
    }
    if (all_empty) {
      continue;
    }
    if (cells != columns_.size()) {
      // Of a file with a heading no row fits its first line.
      const std::string heading =
          row_count() > 0 ? ""
                          : ", as the first row, which names the columns: what stands before "
                            "these begins with #";
      throw InvalidInput("row " + std::to_string(line) + " has " + std::to_string(cells) +
                         " cells; expected " + std::to_string(columns_.size()) + heading);
    }
    starts_.push_back(start);
    lines_.push_back(line);
    if (row_count() % kRowsPerInterrupt == 0) {
      check_interrupt();
    }
  }
  if (lines_.empty() && part.last && !has_more_before) {
    throw InvalidInput("there are no rows below the header");
  }
  if (all_numbers) {
    throw InvalidInput("its first row has numbers; expected the names of the columns");
  }
  keep(row_count());
}

void CsvTable::keep(Index rows) {
  if (rows < 0 || rows > row_count()) {
    throw InvalidInput(std::to_string(rows) + " rows to keep of " + std::to_string(row_count()));
  }
  const auto count = static_cast<std::size_t>(rows);
  starts_.resize(count);
  lines_.resize(count);
  for (CsvColumn& column : columns_) {
    column.numbers.conservativeResize(rows);
    column.empty.conservativeResize(rows);
    for (Index* first : {&column.text, &column.point, &column.comma}) {
      *first = *first < rows ? *first : -1;
    }
  }
}

Index CsvTable::last_run(Index column) const {
  Index first = std::max<Index>(row_count() - 1, 0);
  while (first > 0 && cell(first - 1, column) == cell(row_count() - 1, column)) {
    --first;
  }
  return first;
}

std::string CsvTable::cell(Index row, Index column) const {
  Reader reader(text_, separator_);
  reader.go_to(text_.data() + starts_.at(static_cast<std::size_t>(row)));
  for (Index each = 0; each < column; ++each) {
    reader.cell();
    reader.next_cell();
  }
  return std::string(reader.cell());
}

CsvWords CsvTable::words(Index column) const {
  CsvWords words{Eigen::VectorXi(row_count()), {}};
  std::unordered_map<std::string, int> codes;
  for (Index row = 0; row < row_count(); ++row) {
    std::string word = cell(row, column);
    if (word.empty()) {
      words.codes[row] = -1;
      continue;
    }
    // Rows of one word stand together, mostly.
    if (row > 0 && words.codes[row - 1] >= 0 &&
        words.distinct[static_cast<std::size_t>(words.codes[row - 1])] == word) {
      words.codes[row] = words.codes[row - 1];
      continue;
    }
    const auto [found, is_new] = codes.try_emplace(std::move(word), static_cast<int>(codes.size()));
    if (is_new) {
      words.distinct.push_back(found->first);
    }
    words.codes[row] = found->second;
  }
  return words;
}

}  // namespace symkin

#undef SYMKIN_READS_DOUBLES
