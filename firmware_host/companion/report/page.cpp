#include "firmware_host/companion/report/page.hpp"

#include <fmt/format.h>

namespace rig::host {

namespace {

constexpr std::string_view kStyle = R"(
body { font: 14px/1.45 system-ui, "DejaVu Sans", sans-serif; color: #1a1a1a; background: #fff;
       max-width: 860px; margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.5em; margin: 0 0 .3em; }
h2 { font-size: 1.15em; margin: 1.8em 0 .4em; border-bottom: 1px solid #bbb; break-after: avoid; }
p { margin: .4em 0; }
figure { margin: .8em 0; break-inside: avoid; }
figcaption { color: #555; font-size: .9em; }
svg { max-width: 100%; height: auto; }
table { border-collapse: collapse; margin: .6em 0; font-variant-numeric: tabular-nums; }
thead { display: table-header-group; }
th { text-align: right; font-weight: 600; border-bottom: 1px solid #888; }
td { text-align: right; border-bottom: 1px solid #e4e4e4; }
th, td { padding: .12em .7em .12em 0; white-space: nowrap; }
th:first-child, td:first-child { text-align: left; }
tr { break-inside: avoid; }
tr.flagged td { background: #fdf0e3; }
tr.flagged td:first-child::after { content: " \25C0"; color: #b3541e; }
@media print { body { font-size: 10px; max-width: none; margin: 0; } h2 { margin-top: 1.2em; }
               tr.flagged td { print-color-adjust: exact; -webkit-print-color-adjust: exact; } }
)";

}  // namespace

std::string escaped(std::string_view text) {
    std::string out;
    out.reserve(text.size());
    for (const char c : text) {
        switch (c) {
            case '&':
                out += "&amp;";
                break;
            case '<':
                out += "&lt;";
                break;
            case '>':
                out += "&gt;";
                break;
            case '"':
                out += "&quot;";
                break;
            case '\'':
                out += "&#39;";
                break;
            default: {
                const auto byte = static_cast<unsigned char>(c);
                out += byte < 0x20 || byte == 0x7F ? '?' : c;
            }
        }
    }
    return out;
}

Page::Page(std::string_view title) : title_(escaped(title)) {}

void Page::heading(std::string_view text) {
    body_ += fmt::format("<h2>{}</h2>\n", escaped(text));
}

void Page::paragraph(std::string_view text) {
    body_ += fmt::format("<p>{}</p>\n", escaped(text));
}

void Page::figure(std::string_view svg, std::string_view caption) {
    body_ += fmt::format("<figure>{}<figcaption>{}</figcaption></figure>\n", svg, escaped(caption));
}

void Page::table(const std::vector<std::string>& columns, const std::vector<Row>& rows) {
    body_ += "<table><thead><tr>";
    for (const std::string& column : columns) body_ += fmt::format("<th>{}</th>", escaped(column));
    body_ += "</tr></thead><tbody>\n";
    for (const Row& row : rows) {
        body_ += row.flagged ? "<tr class=\"flagged\">" : "<tr>";
        for (const std::string& cell : row.cells) body_ += fmt::format("<td>{}</td>", escaped(cell));
        body_ += "</tr>\n";
    }
    body_ += "</tbody></table>\n";
}

std::string Page::html() const {
    return fmt::format(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
        "'unsafe-inline'\">\n"
        "<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n<h1>{}</h1>\n{}</body>\n</html>\n",
        title_, kStyle, title_, body_);
}

}  // namespace rig::host
