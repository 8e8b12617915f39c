// The text of a fault plan.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/base/check.hpp"
#include "hal/sim/fault_plan.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto plan = rig::sim::parse_fault_plan({reinterpret_cast<const char*>(data), size});
    if (!plan) {
        RIG_CHECK(plan.error().line > 0 && !plan.error().reason.empty());
        return 0;
    }
    for (const rig::sim::FaultEvent& event : plan->events) {
        RIG_CHECK(event.at_us >= 0 && event.for_us >= 0);
        RIG_CHECK(event.for_us == 0 || plan->active(event.what, event.target, event.at_us) != nullptr);
    }
    return 0;
}
