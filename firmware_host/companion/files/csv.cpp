#include "firmware_host/companion/files/csv.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <iterator>
#include <unordered_set>

#include "core/base/check.hpp"
#include "firmware_host/companion/files/whole_file.hpp"

namespace rig::host {

namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

std::string_view trimmed(std::string_view field) {
    const std::size_t first = field.find_first_not_of(" \t");
    if (first == std::string_view::npos) return {};
    return field.substr(first, field.find_last_not_of(" \t") - first + 1);
}

void split(std::string_view line, std::vector<std::string_view>& fields) {
    fields.clear();
    while (true) {
        const std::size_t comma = line.find(',');
        fields.push_back(trimmed(line.substr(0, comma)));
        if (comma == std::string_view::npos) return;
        line.remove_prefix(comma + 1);
    }
}

}  // namespace

Result<CsvReader, FileError> CsvReader::open(std::string_view text, std::filesystem::path name) {
    if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
    if (text.empty()) return file_failure(name, "the file is empty, expected a header line");
    if (text.find('\0') != std::string_view::npos)
        return file_failure(name, "not a text file (it holds a zero byte)");
    CsvReader reader{text, std::move(name)};
    split(reader.take_line(), reader.fields_);
    std::unordered_set<std::string_view> seen;
    for (const std::string_view column : reader.fields_) {
        if (column.empty()) return reader.fail("a column has no name in the header line");
        if (!seen.insert(column).second) {
            return reader.fail(fmt::format("column '{}' is there twice", printable(column)));
        }
        reader.columns_.emplace_back(column);
    }
    return reader;
}

std::string_view CsvReader::take_line() {
    const std::size_t end = rest_.find('\n');
    std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    if (line.ends_with('\r')) line.remove_suffix(1);
    ++line_;
    return line;
}

Result<bool, FileError> CsvReader::next() {
    if (rest_.find_first_not_of("\r\n") == std::string_view::npos) return false;
    split(take_line(), fields_);
    if (fields_.size() != columns_.size()) {
        return fail(fmt::format("{} fields, expected {} as in the header", fields_.size(), columns_.size()));
    }
    return true;
}

Result<double, FileError> CsvReader::number(std::size_t column) const {
    const std::string_view field = fields_[column];
    double value = 0.0;
    const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
    if (error != std::errc{} || end != field.data() + field.size() || !std::isfinite(value)) {
        return fail(fmt::format("column '{}' is '{}', expected a finite number", printable(columns_[column]),
                                printable(field)));
    }
    return value;
}

Result<std::int64_t, FileError> CsvReader::integer(std::size_t column) const {
    const std::string_view field = fields_[column];
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
    if (error != std::errc{} || end != field.data() + field.size()) {
        return fail(fmt::format("column '{}' is '{}', expected an integer", printable(columns_[column]),
                                printable(field)));
    }
    return value;
}

std::unexpected<FileError> CsvReader::fail(std::string_view fault) const {
    return file_failure_at(name_, line_, fault);
}

Result<NumericTable, FileError> parse_numeric_csv(std::string_view text, const std::filesystem::path& name) {
    auto reader = CsvReader::open(text, name);
    if (!reader) return failure(reader.error());
    NumericTable table;
    table.columns = reader->columns();
    while (true) {
        const auto more = reader->next();
        if (!more) return failure(more.error());
        if (!*more) return table;
        for (std::size_t column = 0; column < table.columns.size(); ++column) {
            const auto value = reader->number(column);
            if (!value) return failure(value.error());
            table.values.push_back(*value);
        }
        ++table.row_count;
    }
}

Result<NumericTable, FileError> read_numeric_csv(const std::filesystem::path& path) {
    const auto text = read_whole_text(path);
    if (!text) return failure(text.error());
    return parse_numeric_csv(*text, path);
}

CsvWriter::CsvWriter(const std::vector<std::string>& columns) : column_count_(columns.size()) {
    for (const std::string& column : columns) text(column);
    end_row();
}

void CsvWriter::separate() {
    RIG_CHECK(column_ < column_count_);
    if (column_++ > 0) contents_ += ',';
}

CsvWriter& CsvWriter::text(std::string_view field) {
    separate();
    contents_ += field;
    return *this;
}

CsvWriter& CsvWriter::integer(std::int64_t value) {
    separate();
    fmt::format_to(std::back_inserter(contents_), "{}", value);
    return *this;
}

CsvWriter& CsvWriter::number(double value, int decimals) {
    separate();
    if (std::isnan(value)) {
        contents_ += "nan";
    } else {
        fmt::format_to(std::back_inserter(contents_), "{:.{}f}", value, decimals);
    }
    return *this;
}

void CsvWriter::end_row() {
    RIG_CHECK(column_ == column_count_);
    contents_ += '\n';
    column_ = 0;
}

Result<void, FileError> CsvWriter::save(const std::filesystem::path& path) const {
    return write_whole_text(path, contents_);
}

}  // namespace rig::host
