// NAME_replay CORPUS_FOLDER MUTATIONS    each file of the folder, then MUTATIONS deterministic variations of
// each NAME_replay FILE [MUTATION]            one file alone, or one of its variations: to reproduce a
// failure
#include <algorithm>
#include <array>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <system_error>
#include <vector>

#include <unistd.h>

#include "tests/support/digest.hpp"
#include "tests/support/random.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
// Present when a sanitizer is linked in.
extern "C" [[gnu::weak]] void __sanitizer_set_death_callback(void (*callback)());

namespace {

using Bytes = std::vector<std::uint8_t>;

std::array<char, 1024> g_current{};  // what runs now, written out by the handlers below

void say_current() {
    const std::size_t length =
        static_cast<std::size_t>(std::find(g_current.begin(), g_current.end(), '\0') - g_current.begin());
    if (write(STDERR_FILENO, g_current.data(), length) < 0) _exit(3);
}

void on_signal(int signal_number) {
    say_current();
    std::signal(signal_number, SIG_DFL);
    std::raise(signal_number);
}

void tell_on_death() {
    if (__sanitizer_set_death_callback != nullptr) {
        __sanitizer_set_death_callback(say_current);
        return;
    }
    for (const int number : {SIGABRT, SIGSEGV, SIGILL, SIGFPE, SIGBUS}) std::signal(number, on_signal);
}

Bytes read_file(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) {
        std::fprintf(stderr, "fuzz replay: cannot read %s\n", path.c_str());
        std::exit(2);
    }
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// One small change. Extremes of the usual field widths are tried often: lengths and counts hide there.
void change_once(Bytes& bytes, rig::test::SeededRandom& random) {
    if (bytes.empty()) {
        bytes.push_back(static_cast<std::uint8_t>(random.bits()));
        return;
    }
    const std::size_t at = random.below(bytes.size());
    const auto position = bytes.begin() + static_cast<std::ptrdiff_t>(at);
    switch (random.below(7)) {
        case 0:
            bytes[at] ^= static_cast<std::uint8_t>(1U << random.below(8));
            break;
        case 1:
            bytes[at] = static_cast<std::uint8_t>(random.bits());
            break;
        case 2: {
            constexpr std::array<std::uint8_t, 5> kExtremes{0x00, 0x01, 0x7f, 0x80, 0xff};
            const std::size_t width =
                std::min<std::size_t>(std::size_t{1} << random.below(4), bytes.size() - at);
            std::fill_n(position, width, kExtremes[random.below(kExtremes.size())]);
            break;
        }
        case 3:
            bytes.resize(at);
            break;
        case 4:
            bytes.insert(position, static_cast<std::uint8_t>(random.bits()));
            break;
        case 5:
            bytes.erase(position,
                        position + static_cast<std::ptrdiff_t>(
                                       1 + random.below(std::min<std::size_t>(bytes.size() - at, 16))));
            break;
        default: {
            const std::size_t length = 1 + random.below(std::min<std::size_t>(bytes.size() - at, 64));
            const Bytes part(position, position + static_cast<std::ptrdiff_t>(length));
            const std::size_t to = random.below(bytes.size());
            bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(to), part.begin(), part.end());
        }
    }
}

Bytes mutated(Bytes bytes, std::uint64_t mutation) {
    rig::test::Digest digest;
    digest.add_bytes(std::as_bytes(std::span<const std::uint8_t>(bytes)));
    rig::test::SeededRandom random(digest.value() + mutation);
    const std::uint64_t changes = 1 + random.below(4);
    for (std::uint64_t i = 0; i < changes; ++i) change_once(bytes, random);
    return bytes;
}

void run(const std::filesystem::path& path, std::uint64_t mutation, const Bytes& bytes) {
    std::snprintf(g_current.data(), g_current.size(),
                  "fuzz replay: failed in %s, mutation %llu (0: as it is)\n", path.c_str(),
                  static_cast<unsigned long long>(mutation));
    // A copy of the exact size, so that a sanitizer sees a read one byte past the end.
    const Bytes exact(bytes);
    LLVMFuzzerTestOneInput(exact.data(), exact.size());
}

// The file as it is and its variations 1 .. mutations. Returns the number of inputs tried.
std::uint64_t run_file(const std::filesystem::path& path, std::uint64_t mutations) {
    const Bytes bytes = read_file(path);
    run(path, 0, bytes);
    for (std::uint64_t i = 1; i <= mutations; ++i) run(path, i, mutated(bytes, i));
    return mutations + 1;
}

std::vector<std::filesystem::path> files_of(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
        if (entry.is_regular_file()) files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    return files;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc < 2 || argc > 3) {
        std::fprintf(stderr, "usage: %s CORPUS_FOLDER MUTATIONS | FILE [MUTATION]\n", argv[0]);
        return 2;
    }
    tell_on_death();
    const std::filesystem::path path = argv[1];
    const std::uint64_t number = argc == 3 ? std::strtoull(argv[2], nullptr, 10) : 0;
    if (std::filesystem::is_regular_file(path)) {
        const Bytes bytes = read_file(path);
        run(path, number, number == 0 ? bytes : mutated(bytes, number));
        std::printf("fuzz replay: passed\n");
        return 0;
    }
    const std::vector<std::filesystem::path> files = files_of(path);
    if (files.empty()) {
        std::fprintf(stderr, "fuzz replay: %s holds no file; a corpus needs at least one valid input\n",
                     path.c_str());
        return 2;
    }
    run("(empty input)", 0, {});
    std::uint64_t tried = 1;
    for (const std::filesystem::path& file : files) tried += run_file(file, number);
    std::printf("fuzz replay: %zu files, %llu inputs, none failed\n", files.size(),
                static_cast<unsigned long long>(tried));
    return 0;
}
