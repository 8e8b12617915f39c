#include "firmware_host/companion/files/obj.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "firmware_host/companion/files/whole_file.hpp"

namespace rig::host {

namespace {

constexpr std::string_view kBlanks = " \t\r";
constexpr std::array<std::string_view, 9> kReadOver{"vt", "vn", "vp", "g", "o", "s", "l", "p", "mtllib"};

// The next word of a line, empty at its end.
std::string_view take_word(std::string_view& line) {
    const std::size_t start = line.find_first_not_of(kBlanks);
    if (start == std::string_view::npos) return line = {};
    line.remove_prefix(start);
    const std::string_view word = line.substr(0, line.find_first_of(kBlanks));
    line.remove_prefix(word.size());
    return word;
}

template <class Number>
std::optional<Number> whole_number(std::string_view word) {
    if (word.starts_with('+')) word.remove_prefix(1);
    Number value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc{} || end != word.data() + word.size()) return std::nullopt;
    return value;
}

class ObjParser {
  public:
    explicit ObjParser(const std::filesystem::path& name) : name_(name) {}

    Result<ObjMesh, FileError> parse(std::string_view text) {
        if (text.empty()) return file_failure(name_, "the file is empty");
        while (!text.empty()) {
            const std::size_t end = text.find('\n');
            ++line_number_;
            if (const auto ok = statement(text.substr(0, end)); !ok) return failure(ok.error());
            text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
        }
        if (mesh_.positions.empty())
            return file_failure(name_, "not an OBJ mesh: it has no vertices (v lines)");
        if (mesh_.polygon_sizes.empty()) return file_failure(name_, "the mesh has no faces (f lines)");
        return std::move(mesh_);
    }

  private:
    [[nodiscard]] std::unexpected<FileError> fail(std::string_view fault) const {
        return file_failure_at(name_, line_number_, fault);
    }

    Result<void, FileError> statement(std::string_view line) {
        line = line.substr(0, line.find('#'));
        const std::string_view keyword = take_word(line);
        if (keyword.empty()) return {};
        if (keyword == "v") return position(line);
        if (keyword == "f") return polygon(line);
        if (keyword == "usemtl") return material(line);
        if (std::ranges::find(kReadOver, keyword) != kReadOver.end()) return {};
        return fail(fmt::format("'{}' is no OBJ statement that is read here", printable(keyword)));
    }

    // x y z, then perhaps a weight or a colour, which no mesh here needs.
    Result<void, FileError> position(std::string_view line) {
        if (mesh_.positions.size() == kMaxObjPositions) return fail("too many vertices");
        std::array<double, 3> point{};
        for (double& x : point) {
            const std::string_view word = take_word(line);
            if (word.empty()) return fail("the vertex is cut short: it needs x, y and z");
            const auto value = whole_number<double>(word);
            if (!value || !std::isfinite(*value)) {
                return fail(fmt::format("'{}' is not a finite number", printable(word)));
            }
            x = *value;
        }
        mesh_.positions.push_back(point);
        return {};
    }

    Result<void, FileError> polygon(std::string_view line) {
        std::int32_t size = 0;
        for (std::string_view word = take_word(line); !word.empty(); word = take_word(line)) {
            const auto corner = corner_index(word);
            if (!corner) return failure(corner.error());
            if (mesh_.corners.size() == kMaxObjCorners) return fail("too many faces");
            mesh_.corners.push_back(*corner);
            ++size;
        }
        if (size < 3) return fail("the face is cut short: it needs three corners or more");
        mesh_.polygon_sizes.push_back(size);
        mesh_.polygon_material.push_back(material_);
        return {};
    }

    // "7", "7/1", "7//2" or "7/1/2"; from 1, or from -1 backwards from the latest vertex.
    Result<std::int32_t, FileError> corner_index(std::string_view word) {
        const auto number = whole_number<std::int64_t>(word.substr(0, word.find('/')));
        if (!number) return fail(fmt::format("'{}' is not a corner of a face", printable(word)));
        const auto count = static_cast<std::int64_t>(mesh_.positions.size());
        const std::int64_t index = *number > 0 ? *number - 1 : count + *number;
        if (*number == 0 || *number < -count || index >= count) {
            return fail(fmt::format("the face names vertex {}, there are {} so far", *number, count));
        }
        return static_cast<std::int32_t>(index);
    }

    Result<void, FileError> material(std::string_view line) {
        const std::string name{take_word(line)};
        if (name.empty()) return fail("usemtl without a name");
        const auto found = std::ranges::find(mesh_.materials, name);
        material_ = static_cast<std::int32_t>(found - mesh_.materials.begin());
        if (found == mesh_.materials.end()) mesh_.materials.push_back(name);
        return {};
    }

    const std::filesystem::path& name_;
    ObjMesh mesh_;
    std::size_t line_number_ = 0;
    std::int32_t material_ = -1;
};

}  // namespace

Result<ObjMesh, FileError> parse_obj(std::string_view text, const std::filesystem::path& name) {
    return ObjParser{name}.parse(text);
}

Result<ObjMesh, FileError> read_obj(const std::filesystem::path& path) {
    const auto text = read_whole_text(path);
    if (!text) return failure(text.error());
    return parse_obj(*text, path);
}

}  // namespace rig::host
