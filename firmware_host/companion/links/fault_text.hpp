// What each fault of the catalogue means, in one plain sentence for the person at the rig.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/faults.hpp"

namespace rig::host {

inline constexpr int kLastFault = 55;

// number: 1..64, the bit of the fault map plus one. Numbers beyond the catalogue come from a newer board and
// get a sentence that says so.
[[nodiscard]] std::string_view fault_text(int number);

// "F01".
[[nodiscard]] std::string fault_code(int number);

// Numbers of the bits set, ascending.
[[nodiscard]] std::vector<int> faults_of(FaultMap map);

}  // namespace rig::host
