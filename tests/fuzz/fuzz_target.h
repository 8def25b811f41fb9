#pragma once

#include <cstddef>
#include <cstdint>

/// What libFuzzer, or replay.cpp, calls with one input. Whatever the input is, it must return 0: anything
/// else, a sanitizer's complaint and std::abort are findings.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
