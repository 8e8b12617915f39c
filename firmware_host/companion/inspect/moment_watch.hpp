// Decides, tick by tick, which moments of a take are worth a picture.
#pragma once

#include <functional>
#include <vector>

#include "firmware_host/companion/inspect/take_record.hpp"

namespace rig::host {

class MomentWatch {
  public:
    // Looks at the record's last tick; draws it up only when it is the worst of its kind so far.
    void look(const TakeRecord& record, const std::function<std::vector<SceneView>()>& draw_up);
    // In order of time.
    [[nodiscard]] std::vector<Moment> taken() const { return worst_.taken(kApart_s); }

  private:
    static constexpr double kApart_s = 0.1;

    WorstMoments worst_;
    bool ever_solved_ = false;
    double last_solved_s_ = 0.0;
};

}  // namespace rig::host
