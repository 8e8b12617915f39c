// What a function returns when the world can fail it. Not for our own bugs: those are RIG_CHECKs.
#pragma once

#include <expected>

namespace rig {

// T or one enumerator of the module's error enum E. errno values stop in hal/linux and never appear as E.
template <class T, class E>
using Result = std::expected<T, E>;

template <class E>
[[nodiscard]] constexpr std::unexpected<E> failure(E error) {
    return std::unexpected<E>(error);
}

}  // namespace rig
