// One self-contained HTML page: text, tables and inline SVG, styled for screen and paper. No scripts, nothing
// fetched from elsewhere; pictures inside an SVG are data URIs (data_uri.hpp).
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace rig::host {

// Text as it may stand in HTML and SVG, between tags and in quoted attributes: names are data. Control bytes
// become '?'.
[[nodiscard]] std::string escaped(std::string_view text);

class Page {
  public:
    explicit Page(std::string_view title);

    void heading(std::string_view text);
    void paragraph(std::string_view text);
    // Already markup: an SVG of svg_chart.hpp.
    void figure(std::string_view svg, std::string_view caption);
    // Several that stand side by side where there is room.
    void figures(const std::vector<std::string>& svgs, std::string_view caption);
    // Cells are text. The first column is set left, the others as numbers; `flagged` rows are marked.
    struct Row {
        std::vector<std::string> cells;
        bool flagged = false;
    };
    void table(const std::vector<std::string>& columns, const std::vector<Row>& rows);

    // The whole document. The same content gives the same bytes.
    [[nodiscard]] std::string html() const;

  private:
    std::string title_;
    std::string body_;
};

}  // namespace rig::host
