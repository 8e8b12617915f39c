// Owns one file descriptor.
#pragma once

#include <unistd.h>

#include <utility>

namespace rig::os {

class Descriptor {
  public:
    Descriptor() = default;
    explicit Descriptor(int number) : number_(number) {}
    Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
    Descriptor& operator=(Descriptor&& other) noexcept {
        if (this != &other) {
            reset();
            number_ = std::exchange(other.number_, -1);
        }
        return *this;
    }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    ~Descriptor() { reset(); }

    [[nodiscard]] int get() const { return number_; }
    [[nodiscard]] bool is_open() const { return number_ >= 0; }
    // What close() reports is of no use here: data that must survive was synced before.
    void reset() {
        if (number_ >= 0) static_cast<void>(::close(number_));
        number_ = -1;
    }

  private:
    int number_ = -1;
};

}  // namespace rig::os
