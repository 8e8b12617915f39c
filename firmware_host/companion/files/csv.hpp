// Comma-separated tables: one header line, then rows of the same number of fields. Strict: no quotes, no
// comments, no empty lines between rows. A byte-order mark, CRLF line ends and a missing last newline pass,
// since spreadsheets and editors make them. Blanks around a field are not part of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "firmware_host/companion/files/file_error.hpp"

namespace rig::host {

// Splits a text row by row. Errors name the file and the line.
class CsvReader {
  public:
    // `text` must outlive the reader; `name` stands for the file in errors. Errors: empty text, an empty or
    // repeated column name, a NUL byte.
    [[nodiscard]] static Result<CsvReader, FileError> open(std::string_view text, std::filesystem::path name);

    [[nodiscard]] const std::vector<std::string>& columns() const { return columns_; }
    // True: fields() holds the next row, one field per column. False: the end.
    [[nodiscard]] Result<bool, FileError> next();
    [[nodiscard]] const std::vector<std::string_view>& fields() const { return fields_; }
    // Of the current row. Finite, in the range of the type, nothing after the number.
    [[nodiscard]] Result<double, FileError> number(std::size_t column) const;
    [[nodiscard]] Result<std::int64_t, FileError> integer(std::size_t column) const;
    // "<file>:<line of the current row>: <fault>"
    [[nodiscard]] std::unexpected<FileError> fail(std::string_view fault) const;

  private:
    CsvReader(std::string_view text, std::filesystem::path name) : rest_(text), name_(std::move(name)) {}
    [[nodiscard]] std::string_view take_line();

    std::string_view rest_;
    std::filesystem::path name_;
    std::vector<std::string> columns_;
    std::vector<std::string_view> fields_;
    std::size_t line_ = 0;
};

// A table of numbers alone. values[row * columns.size() + column], all finite.
struct NumericTable {
    std::vector<std::string> columns;
    std::size_t row_count = 0;
    std::vector<double> values;
};
[[nodiscard]] Result<NumericTable, FileError> parse_numeric_csv(std::string_view text,
                                                                const std::filesystem::path& name);
[[nodiscard]] Result<NumericTable, FileError> read_numeric_csv(const std::filesystem::path& path);

// Builds the text of a table: header at construction, then fields in order; every row must be full.
class CsvWriter {
  public:
    explicit CsvWriter(const std::vector<std::string>& columns);
    CsvWriter& text(std::string_view field);  // without comma, newline, quote
    CsvWriter& integer(std::int64_t value);
    CsvWriter& number(double value, int decimals);  // NaN is written as "nan"
    void end_row();
    [[nodiscard]] const std::string& contents() const { return contents_; }
    [[nodiscard]] Result<void, FileError> save(const std::filesystem::path& path) const;

  private:
    void separate();

    std::string contents_;
    std::size_t column_count_;
    std::size_t column_ = 0;
};

}  // namespace rig::host
