#include "tests/hygiene/rules.hpp"

#include <array>

namespace rig::hygiene {

std::span<const Rule> all_rules() {
    static constexpr std::array kRules{
        Rule{"include_spelling", include_spelling},
        Rule{"include_directions", include_directions},
        Rule{"core_headers", core_headers},
        Rule{"backend_naming", backend_naming},
        Rule{"core_words", core_words},
        Rule{"core_globals", core_globals},
        Rule{"product_name", product_name},
        Rule{"empty_names", empty_names},
        Rule{"file_lengths", file_lengths},
        Rule{"function_lengths", function_lengths},
        Rule{"whitespace", whitespace},
        Rule{"machine_paths", machine_paths},
        Rule{"header_form", header_form},
        Rule{"unit_tests", unit_tests},
        Rule{"listed_sources", listed_sources},
        Rule{"folder_readmes", folder_readmes},
        Rule{"fault_codes", fault_codes},
        Rule{"readme_commands", readme_commands},
    };
    return kRules;
}

}  // namespace rig::hygiene
