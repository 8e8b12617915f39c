#include "tests/support/image_truth/image_truth.hpp"

#include <algorithm>

#include "firmware_host/companion/files/csv.hpp"
#include "firmware_host/companion/files/whole_file.hpp"

namespace rig::test {

Result<std::vector<TrueImage>, host::FileError> read_true_images(const std::filesystem::path& folder) {
    const std::filesystem::path table = folder / "truth.csv";
    const auto text = host::read_whole_text(table);
    if (!text) return std::unexpected(text.error());
    auto reader = host::CsvReader::open(*text, table);
    if (!reader) return std::unexpected(reader.error());
    const auto column = [&](std::string_view name) {
        const auto& names = reader->columns();
        return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
    };
    const std::size_t image = column("image"), x = column("dot_cx_px"), y = column("dot_cy_px");
    const std::size_t visible = column("visible"), cosine = column("cos_view");
    if (std::max({image, x, y, visible, cosine}) >= reader->columns().size())
        return host::file_failure(table, "a column is missing");

    std::vector<TrueImage> images;
    for (auto more = reader->next(); more && *more; more = reader->next()) {
        const std::string name(reader->fields()[image]);
        if (images.empty() || images.back().name != name) {
            auto picture = host::read_grey_image(folder / (name + ".pgm"));
            if (!picture) return std::unexpected(picture.error());
            images.push_back({name, std::move(*picture), {}});
        }
        if (reader->fields()[visible] != "1") continue;
        const auto cx = reader->number(x), cy = reader->number(y), cos_view = reader->number(cosine);
        if (!cx || !cy || !cos_view) return host::file_failure(table, "not a number");
        images.back().dots.push_back({*cx, *cy, 3.0, *cos_view > 0.35});
    }
    return images;
}

}  // namespace rig::test
