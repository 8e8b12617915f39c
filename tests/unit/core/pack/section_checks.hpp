// What the tests of a pack's sections ask alike.
#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <span>
#include <vector>

#include "core/pack/open_pack.hpp"
#include "firmware_host/companion/train/pack_writer.hpp"
#include "firmware_host/pack_file/sha256.hpp"
#include "tests/support/pack_samples/aligned_bytes.hpp"

namespace rig::test {

// Of the written pack when it is opened; kCount when it opens.
inline PackError error_of(const SolvePack& pack) {
    const AlignedBytes bytes(host::write_pack(pack, {}, sha256));
    const auto opened = open_pack(bytes.span(), sha256);
    return opened ? PackError::kCount : opened.error();
}

template <class T>
void expect_equal(std::span<const T> got, const std::vector<T>& wanted) {
    ASSERT_EQ(got.size(), wanted.size());
    EXPECT_EQ(std::memcmp(got.data(), wanted.data(), got.size_bytes()), 0);
}

}  // namespace rig::test
