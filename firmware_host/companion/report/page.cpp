#include "firmware_host/companion/report/page.hpp"

#include <fmt/format.h>

namespace rig::host {

namespace {

constexpr std::string_view kStyle = R"(
:root { color-scheme: light dark; --ink: #1a1a1a; --paper: #fff; --soft: #555; --line: #bbb; --row: #e4e4e4;
        --flag: #fdf0e3; --flag-ink: #b3541e; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e3e3e3; --paper: #15181b; --soft: #a6a6a6; --line: #565b60; --row: #2c3136;
          --flag: #3a2a1c; --flag-ink: #e8a26a; }
}
body { font: 14px/1.45 system-ui, "DejaVu Sans", sans-serif; color: var(--ink); background: var(--paper);
       max-width: 860px; margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.5em; margin: 0 0 .3em; overflow-wrap: anywhere; }
h2 { font-size: 1.15em; margin: 1.8em 0 .4em; border-bottom: 1px solid var(--line); break-after: avoid; }
p { margin: .4em 0; max-width: 46em; overflow-wrap: break-word; }
figure { margin: .8em 0; break-inside: avoid; }
figcaption { color: var(--soft); font-size: .9em; max-width: 46em; }
/* Wide charts and tables are pushed sideways on a small screen, not shrunk until nobody can read them. */
.wide { overflow-x: auto; }
.row { display: flex; flex-wrap: wrap; gap: 10px; }
svg { display: block; }
table { border-collapse: collapse; margin: .6em 0; font-variant-numeric: tabular-nums; }
thead { display: table-header-group; }
th { text-align: right; font-weight: 600; border-bottom: 1px solid var(--line); vertical-align: bottom; }
td { text-align: right; border-bottom: 1px solid var(--row); }
th, td { padding: .12em .7em .12em 0; white-space: nowrap; }
th:first-child, td:first-child { text-align: left; }
tr { break-inside: avoid; }
tr.flagged td { background: var(--flag); }
tr.flagged td:first-child::after { content: " \25C0"; color: var(--flag-ink); }
@media print { :root { --ink: #000; --paper: #fff; --soft: #444; --line: #999; --row: #ddd; --flag: #fdf0e3;
                       --flag-ink: #b3541e; }
               body { font-size: 10px; max-width: none; margin: 0; } h2 { margin-top: 1.2em; }
               .wide { overflow-x: visible; } svg { max-width: 100%; height: auto; }
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
    body_ += fmt::format("<figure><div class=\"wide\">{}</div><figcaption>{}</figcaption></figure>\n", svg,
                         escaped(caption));
}

void Page::figures(const std::vector<std::string>& svgs, std::string_view caption) {
    body_ += "<figure><div class=\"row wide\">";
    for (const std::string& svg : svgs) body_ += fmt::format("<div>{}</div>", svg);
    body_ += fmt::format("</div><figcaption>{}</figcaption></figure>\n", escaped(caption));
}

void Page::table(const std::vector<std::string>& columns, const std::vector<Row>& rows) {
    body_ += "<div class=\"wide\"><table>";
    if (!columns.empty()) body_ += "<thead><tr>";
    for (const std::string& column : columns)
        body_ += fmt::format("<th scope=\"col\">{}</th>", escaped(column));
    body_ += columns.empty() ? "<tbody>\n" : "</tr></thead><tbody>\n";
    for (const Row& row : rows) {
        body_ += row.flagged ? "<tr class=\"flagged\">" : "<tr>";
        for (const std::string& cell : row.cells) body_ += fmt::format("<td>{}</td>", escaped(cell));
        body_ += "</tr>\n";
    }
    body_ += "</tbody></table></div>\n";
}

std::string Page::html() const {
    return fmt::format(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; "
        "style-src 'unsafe-inline'\">\n"
        "<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n<h1>{}</h1>\n{}</body>\n</html>\n",
        title_, kStyle, title_, body_);
}

}  // namespace rig::host
