// SPDX-License-Identifier: MIT
#include "symkin/support/csv_table.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "symkin/support/error.hpp"

namespace symkin {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::string refusal(const std::string& text) {
  try {
    const CsvTable table(text);
  } catch (const InvalidInput& error) {
    return error.what();
  }
  return "";
}

TEST(CsvNumber, IsWhatPeopleWrite) {
  EXPECT_EQ(csv_number("1.5", false)->value, 1.5);
  EXPECT_EQ(csv_number("+.5e+1", false)->value, 5.0);
  EXPECT_EQ(csv_number("-7.", false)->value, -7.0);
  EXPECT_EQ(csv_number("-0,25", true)->value, -0.25);
  EXPECT_EQ(csv_number("-0,25", true)->mark, ',');
  EXPECT_EQ(csv_number("3e2", true)->mark, 0);
  EXPECT_EQ(csv_number("-Infinity", false)->value, -kInfinity);
  EXPECT_TRUE(std::isnan(csv_number("NaN", false)->value));
  for (const char* text : {"", "-", "1,5", "1.2.3", "1e", "0x1F", "1_000", "--1", "+-1", "nan(1)",
                           ".", "1 mm", "1.5e3.", "in"}) {
    EXPECT_FALSE(csv_number(text, false)) << text;
  }
}

TEST(CsvNumber, BeyondADoubleIsInfiniteOrNothing) {
  const std::string zeros(400, '0');
  EXPECT_EQ(csv_number("1e999", false)->value, kInfinity);
  EXPECT_EQ(csv_number("-1" + zeros, false)->value, -kInfinity);
  EXPECT_EQ(csv_number("1" + zeros + ".5", false)->value, kInfinity);
  EXPECT_EQ(csv_number("1e-999", false)->value, 0.0);
  EXPECT_EQ(csv_number("0." + zeros + "1", false)->value, 0.0);
  EXPECT_EQ(csv_number("1.7976931348623157e308", false)->value, std::numeric_limits<double>::max());
}

TEST(CsvTable, TellsEmptyCellsTextAndNumbersApart) {
  const std::string text = "a;b;c\n1,5;;x\n;2.5;\n\"3\" ; -4,5e1 ;\"y;\"\"z\"\"\"\n";
  const CsvTable table(text);
  ASSERT_EQ(table.row_count(), 3);
  EXPECT_EQ(table.columns()[0].numbers[0], 1.5);
  EXPECT_TRUE(table.columns()[0].empty[1]);
  EXPECT_EQ(table.columns()[0].numbers[2], 3.0);
  EXPECT_EQ(table.columns()[0].text, -1);
  EXPECT_EQ(table.columns()[1].point, 1);
  EXPECT_EQ(table.columns()[1].comma, 2);
  EXPECT_EQ(table.columns()[2].text, 0);
  EXPECT_EQ(table.cell(2, 2), "y;\"z\"");
  EXPECT_EQ(table.lines(), (std::vector<Index>{2, 3, 4}));
}

TEST(CsvTable, EndsLinesAndPassesOverCommentsAsFilesDo) {
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    const std::string text = "# a" + end + "  " + end + "a,b" + end + "1,\"two" + end +
                             "# lines\"" + end + " # c" + end + "," + end + "2,3";
    const CsvTable table(text);
    EXPECT_EQ(table.lines(), (std::vector<Index>{4, 8})) << text;
    EXPECT_EQ(table.cell(0, 1), "two\n# lines");
    EXPECT_EQ(table.columns()[1].numbers[1], 3.0);
  }
}

TEST(CsvTable, CountsWordsOnceInTheirOrder) {
  const std::string text = "robot\tx\nB\t1\nB\t2\n007\t3\nB\t4\n\t5\n";
  const CsvWords words = CsvTable(text).words(0);
  EXPECT_EQ(words.distinct, (std::vector<std::string>{"B", "007"}));
  EXPECT_EQ(words.codes, (Eigen::VectorXi(5) << 0, 0, 1, 0, -1).finished());
}

TEST(CsvNumber, IsWrittenAsPythonWritesIt) {
  for (const auto& [value, text] : std::vector<std::pair<double, std::string>>{
           {0.1, "0.1"},
           {-12.5, "-12.5"},
           {-0.0, "-0"},
           {1e15, "1000000000000000"},
           {1e16, "1e+16"},
           {1e-4, "0.0001"},
           {1.5e-5, "1.5e-05"},
           {5e-324, "5e-324"},
           {123456789.25, "123456789.25"},
           {-kInfinity, "-inf"},
           {std::numeric_limits<double>::quiet_NaN(), ""}}) {
    EXPECT_EQ(csv_cell(value), text);
  }
}

TEST(CsvTable, IsReadInPartsAsItIsAsAWhole) {
  const std::string text =
      "# a\nrobot,x\r\nA,1\r\nA,2\n\n\"B\nb\",3.5\n\"B\nb\",4\n# c\nC,\n,\nC,text\n";
  const CsvTable whole(text);
  const std::string header = text.substr(0, whole.header_size());
  EXPECT_EQ(header, "# a\nrobot,x\r\n");
  for (std::size_t size = 1; size < text.size(); ++size) {
    std::vector<Index> lines;
    std::string left;
    CsvPart part{0, false};
    for (std::size_t at = header.size(); !part.last; at += size) {
      left += text.substr(at, size);
      part.last = at + size >= text.size();
      const std::string given = header + left;
      CsvTable table(given, part);
      const Index rows = part.last ? table.row_count() : table.last_run(0);
      if (rows < table.row_count()) {
        part.passed = table.lines()[static_cast<std::size_t>(rows)] - table.header_lines() - 1;
        left = given.substr(table.start(rows));
        table.keep(rows);
      }
      for (Index row = 0; row < rows; ++row) {
        EXPECT_EQ(table.cell(row, 1), whole.cell(static_cast<Index>(lines.size()), 1));
        lines.push_back(table.lines()[static_cast<std::size_t>(row)]);
      }
    }
    EXPECT_EQ(lines, whole.lines()) << size;
  }
}

TEST(CsvTable, NamesTheLineOfWhatItRefuses) {
  EXPECT_EQ(refusal("a,b\n1,2\n\n3\n"), "row 4 has 1 cells; expected 2");
  EXPECT_EQ(refusal("a log\n\n1,2,3\n"),
            "row 3 has 3 cells; expected 1, as the first row, which names the columns: what stands "
            "before these begins with #");
  EXPECT_EQ(refusal("a\n1\x01\n"), "cannot be read: row 2 has a character '\\x01'; expected text");
  EXPECT_EQ(refusal("a,b\n,\n"), "there are no rows below the header");
  EXPECT_EQ(refusal("1,2\n3,4\n"), "its first row has numbers; expected the names of the columns");
  EXPECT_NE(refusal("a\n\"" + std::string(200000, 'x')).find("row 2 cannot be read"),
            std::string::npos);
}

}  // namespace
}  // namespace symkin
