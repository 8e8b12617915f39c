#include "firmware_host/companion/files/csv.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/support/temp_folder.hpp"

namespace rig::host {
namespace {

TEST(Csv, ReadsNumbers) {
    const auto table = parse_numeric_csv("a,b\n1,2.5\n-3e2,0\n", "t.csv");
    ASSERT_TRUE(table) << table.error().message;
    EXPECT_EQ(table->columns, (std::vector<std::string>{"a", "b"}));
    EXPECT_EQ(table->row_count, 2U);
    EXPECT_EQ(table->values, (std::vector<double>{1, 2.5, -300, 0}));
}

TEST(Csv, SpreadsheetHabitsPass) {
    const auto table = parse_numeric_csv(
        "\xEF\xBB\xBF"
        "a, b\r\n1 ,2\r\n3,\t4",
        "t.csv");
    ASSERT_TRUE(table) << table.error().message;
    EXPECT_EQ(table->columns, (std::vector<std::string>{"a", "b"}));
    EXPECT_EQ(table->values, (std::vector<double>{1, 2, 3, 4}));
}

TEST(Csv, HeaderAloneHasNoRows) {
    const auto table = parse_numeric_csv("a,b", "t.csv");
    ASSERT_TRUE(table) << table.error().message;
    EXPECT_EQ(table->row_count, 0U);
}

TEST(Csv, TextFieldsAreViews) {
    const std::string text = "name,n\nnose,3\n";
    auto reader = CsvReader::open(text, "t.csv");
    ASSERT_TRUE(reader);
    ASSERT_TRUE(reader->next().value());
    EXPECT_EQ(reader->fields()[0], "nose");
    EXPECT_EQ(reader->integer(1).value(), 3);
    EXPECT_FALSE(reader->next().value());
    EXPECT_FALSE(reader->next().value());
}

struct BadText {
    std::string label;
    std::string text;
    std::string fault;
};

class MalformedCsv : public testing::TestWithParam<BadText> {};

TEST_P(MalformedCsv, NamesFileLineAndFault) {
    const auto table = parse_numeric_csv(GetParam().text, "bad.csv");
    ASSERT_FALSE(table);
    EXPECT_NE(table.error().message.find(GetParam().fault), std::string::npos) << table.error().message;
}

INSTANTIATE_TEST_SUITE_P(
    Table, MalformedCsv,
    testing::Values(BadText{"empty", "", "bad.csv: the file is empty"},
                    BadText{"zero_byte", std::string("a,b\n1,\0", 7), "bad.csv: not a text file"},
                    BadText{"nameless", "a,\n1,2\n", "bad.csv:1: a column has no name"},
                    BadText{"twice", "a,a\n1,2\n", "bad.csv:1: column 'a' is there twice"},
                    BadText{"few", "a,b\n1,2\n3\n", "bad.csv:3: 1 fields, expected 2"},
                    BadText{"many", "a,b\n1,2,3\n", "bad.csv:2: 3 fields, expected 2"},
                    BadText{"gap", "a,b\n1,2\n\n3,4\n", "bad.csv:3: 1 fields"},
                    BadText{"word", "a,b\n1,two\n", "bad.csv:2: column 'b' is 'two'"},
                    BadText{"tail", "a,b\n1,2x\n", "bad.csv:2"},
                    BadText{"hole", "a,b\n,2\n", "bad.csv:2: column 'a'"},
                    BadText{"nan", "a,b\nnan,2\n", "bad.csv:2: column 'a'"},
                    BadText{"infinite", "a,b\n1,inf\n", "finite"},
                    BadText{"huge", "a,b\n1,1e999\n", "finite"},
                    BadText{"quoted", "a,b\n\"1\",2\n", "bad.csv:2"}),
    [](const auto& row) { return row.param.label; });

TEST(CsvWriter, WritesWhatTheReaderReads) {
    CsvWriter writer{{"frame", "name", "x"}};
    writer.integer(0).text("nose").number(1.0 / 3.0, 4).end_row();
    writer.integer(-7).text("chin").number(std::numeric_limits<double>::quiet_NaN(), 4).end_row();
    EXPECT_EQ(writer.contents(), "frame,name,x\n0,nose,0.3333\n-7,chin,nan\n");
}

TEST(CsvWriter, NamesAPathThatCannotBeWritten) {
    const rig::test::TempFolder folder;
    const auto saved = CsvWriter{{"a"}}.save(folder / "no_such_folder/x.csv");
    ASSERT_FALSE(saved);
    EXPECT_NE(saved.error().message.find("no_such_folder/x.csv"), std::string::npos);
}

}  // namespace
}  // namespace rig::host
