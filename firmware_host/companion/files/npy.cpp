#include "firmware_host/companion/files/npy.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/check.hpp"
#include "firmware_host/companion/files/whole_file.hpp"

namespace rig::host {

namespace {

constexpr std::string_view kMagic = "\x93NUMPY";
constexpr std::size_t kPreambleBytes = 10;  // magic, version, 16-bit length of the header text
constexpr std::uint64_t kMaxElements = std::uint64_t{1} << 31;
constexpr std::size_t kMaxDimensions = 8;
constexpr std::size_t kAlignment = 64;  // of the data, as NumPy itself writes it

template <class T>
constexpr std::string_view kDescr = "";
template <>
constexpr std::string_view kDescr<float> = "<f4";
template <>
constexpr std::string_view kDescr<double> = "<f8";
template <>
constexpr std::string_view kDescr<std::int32_t> = "<i4";
template <>
constexpr std::string_view kDescr<std::int16_t> = "<i2";
template <>
constexpr std::string_view kDescr<std::uint8_t> = "|u1";

struct Header {
    std::string descr;
    std::optional<bool> fortran_order;
    std::optional<std::vector<std::size_t>> shape;
};

// Reads the one Python dictionary literal that a header is: keys descr, fortran_order and shape in any order.
class HeaderParser {
  public:
    explicit HeaderParser(std::string_view text) : rest_(text) {}

    [[nodiscard]] std::optional<Header> parse() {
        Header header;
        if (!take('{')) return std::nullopt;
        while (!take('}')) {
            if (!entry(header)) return std::nullopt;
            if (take(',')) continue;
            if (!take('}')) return std::nullopt;
            break;
        }
        skip_space();
        if (!rest_.empty() || header.descr.empty() || !header.fortran_order || !header.shape)
            return std::nullopt;
        return header;
    }

  private:
    bool entry(Header& header) {
        const std::optional<std::string> key = quoted();
        if (!key || !take(':')) return false;
        if (*key == "descr") {
            const std::optional<std::string> descr = quoted();
            if (!descr || !header.descr.empty()) return false;
            header.descr = *descr;
            return true;
        }
        if (*key == "fortran_order" && !header.fortran_order) {
            header.fortran_order = boolean();
            return header.fortran_order.has_value();
        }
        if (*key == "shape" && !header.shape) {
            header.shape = tuple();
            return header.shape.has_value();
        }
        return false;
    }

    std::optional<std::string> quoted() {
        skip_space();
        if (rest_.empty() || (rest_.front() != '\'' && rest_.front() != '"')) return std::nullopt;
        const std::size_t end = rest_.find(rest_.front(), 1);
        if (end == std::string_view::npos) return std::nullopt;
        std::string text{rest_.substr(1, end - 1)};
        rest_.remove_prefix(end + 1);
        return text;
    }

    std::optional<bool> boolean() {
        if (take_word("True")) return true;
        if (take_word("False")) return false;
        return std::nullopt;
    }

    std::optional<std::vector<std::size_t>> tuple() {
        std::vector<std::size_t> sizes;
        if (!take('(')) return std::nullopt;
        while (!take(')')) {
            skip_space();
            std::size_t size = 0;
            const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), size);
            if (error != std::errc{} || sizes.size() == kMaxDimensions) return std::nullopt;
            rest_.remove_prefix(static_cast<std::size_t>(end - rest_.data()));
            sizes.push_back(size);
            if (take(',')) continue;
            if (!take(')')) return std::nullopt;
            break;
        }
        return sizes;
    }

    void skip_space() {
        const std::size_t start = rest_.find_first_not_of(" \n");
        rest_.remove_prefix(start == std::string_view::npos ? rest_.size() : start);
    }
    bool take(char c) {
        skip_space();
        if (rest_.empty() || rest_.front() != c) return false;
        rest_.remove_prefix(1);
        return true;
    }
    bool take_word(std::string_view word) {
        skip_space();
        if (!rest_.starts_with(word)) return false;
        rest_.remove_prefix(word.size());
        return true;
    }

    std::string_view rest_;
};

// Empty when there are too many elements.
std::optional<std::uint64_t> element_count(const std::vector<std::size_t>& shape) {
    std::uint64_t count = 1;
    for (const std::size_t size : shape) {
        if (size != 0 && count > kMaxElements / size) return std::nullopt;
        count *= size;
    }
    return count;
}

struct CheckedFile {
    Header header;
    ByteSpan data;
    std::size_t count = 0;
};

Result<CheckedFile, FileError> check_header(ByteSpan bytes, const std::filesystem::path& name) {
    if (bytes.empty()) return file_failure(name, "the file is empty");
    if (bytes.size() < kPreambleBytes || std::memcmp(bytes.data(), kMagic.data(), kMagic.size()) != 0) {
        return file_failure(name, "not a .npy file (it does not start with \\x93NUMPY)");
    }
    const int major = load<std::uint8_t>(bytes, 6);
    if (major != 1)
        return file_failure(name, fmt::format(".npy version {} is not read here, only version 1", major));
    const std::size_t text_bytes = load<std::uint16_t>(bytes, 8);
    if (bytes.size() - kPreambleBytes < text_bytes)
        return file_failure(name, "the file ends within its header");
    const ByteSpan text = bytes.subspan(kPreambleBytes, text_bytes);
    CheckedFile file;
    const std::optional<Header> header =
        HeaderParser{{reinterpret_cast<const char*>(text.data()), text.size()}}.parse();
    if (!header) return file_failure(name, "the .npy header is malformed");
    file.header = *header;
    file.data = bytes.subspan(kPreambleBytes + text_bytes);
    if (*file.header.fortran_order) {
        return file_failure(name, "the array is in Fortran order; save it with numpy.ascontiguousarray");
    }
    const std::optional<std::uint64_t> count = element_count(*file.header.shape);
    if (!count) return file_failure(name, "the array has more than 2^31 elements");
    file.count = static_cast<std::size_t>(*count);
    return file;
}

template <class Stored, class T>
Result<NpyArray<T>, FileError> take_values(const CheckedFile& file, const std::filesystem::path& name) {
    const std::size_t expected = file.count * sizeof(Stored);
    if (file.data.size() != expected) {
        return file_failure(
            name, fmt::format("the data is {}: {} bytes for shape ({}), expected {}",
                              file.data.size() < expected ? "cut short" : "too long", file.data.size(),
                              fmt::join(*file.header.shape, ","), expected));
    }
    NpyArray<T> array;
    array.shape = *file.header.shape;
    array.values.resize(file.count);
    for (std::size_t i = 0; i < file.count; ++i) {
        array.values[i] = static_cast<T>(load<Stored>(file.data, i * sizeof(Stored)));
    }
    return array;
}

std::string header_text(std::string_view descr, const std::vector<std::size_t>& shape) {
    const char* comma = shape.size() == 1 ? "," : "";
    std::string text = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}{}), }}", descr,
                                   fmt::join(shape, ", "), comma);
    while ((kPreambleBytes + text.size() + 1) % kAlignment != 0) text += ' ';
    return text + '\n';
}

}  // namespace

template <class T>
Result<NpyArray<T>, FileError> parse_npy(ByteSpan bytes, const std::filesystem::path& name) {
    const Result<CheckedFile, FileError> file = check_header(bytes, name);
    if (!file) return failure(file.error());
    if (file->header.descr == kDescr<T>) return take_values<T, T>(*file, name);
    if constexpr (std::is_same_v<T, float>) {
        if (file->header.descr == kDescr<double>) return take_values<double, float>(*file, name);
    }
    return file_failure(name, fmt::format("the array's type is '{}', expected '{}'",
                                          printable(file->header.descr), kDescr<T>));
}

template <class T>
Result<NpyArray<T>, FileError> read_npy(const std::filesystem::path& path) {
    const auto bytes = read_whole_file(path);
    if (!bytes) return failure(bytes.error());
    return parse_npy<T>(*bytes, path);
}

template <class T>
Result<void, FileError> write_npy(const std::filesystem::path& path, const NpyArray<T>& array) {
    RIG_CHECK(element_count(array.shape) == array.values.size());
    const std::string text = header_text(kDescr<T>, array.shape);
    std::vector<std::byte> bytes(kPreambleBytes + text.size() + array.values.size() * sizeof(T));
    ByteWriter writer{bytes};
    writer.write_bytes(std::as_bytes(std::span{kMagic.data(), kMagic.size()}));
    writer.write(std::uint8_t{1});
    writer.write(std::uint8_t{0});
    writer.write(static_cast<std::uint16_t>(text.size()));
    writer.write_bytes(std::as_bytes(std::span{text.data(), text.size()}));
    writer.write_bytes(std::as_bytes(std::span{array.values.data(), array.values.size()}));
    RIG_CHECK(writer.ok());
    return write_whole_file(path, bytes);
}

#define RIG_INSTANTIATE_NPY(T)                                                                    \
    template Result<NpyArray<T>, FileError> parse_npy<T>(ByteSpan, const std::filesystem::path&); \
    template Result<NpyArray<T>, FileError> read_npy<T>(const std::filesystem::path&);            \
    template Result<void, FileError> write_npy<T>(const std::filesystem::path&, const NpyArray<T>&);
RIG_INSTANTIATE_NPY(float)
RIG_INSTANTIATE_NPY(double)
RIG_INSTANTIATE_NPY(std::int32_t)
RIG_INSTANTIATE_NPY(std::uint8_t)
RIG_INSTANTIATE_NPY(std::int16_t)
#undef RIG_INSTANTIATE_NPY

}  // namespace rig::host
