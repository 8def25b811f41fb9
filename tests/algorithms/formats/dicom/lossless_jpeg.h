#pragma once

#include <string>

namespace volsmooth::test {

inline constexpr int kEdge = 4;

/// A segment of a JPEG stream: FF, marker, length, body.
inline std::string segment(int marker, const std::string& body) {
  const std::size_t length = body.size() + 2;
  return {std::string{'\xff', static_cast<char>(marker), static_cast<char>(length >> 8),
                      static_cast<char>(length & 0xff)} +
          body};
}

inline std::string frame(int marker, int bits) {
  return segment(marker, std::string{static_cast<char>(bits), 0, kEdge, 0, kEdge, 1, 1, 0x11, 0});
}

/// The one code word, 0, of the one category that occurs: a pixel is what is predicted.
inline const std::string kHuffmanTable = segment(0xc4, std::string("\0\1", 2) + std::string(16, '\0'));
inline const std::string kScan = segment(0xda, std::string("\1\1\0\1\0\0", 6));
inline const std::string kEnd = std::string(kEdge * kEdge / 8, '\0') + "\xff\xd9";

/// A lossless JPEG whose every pixel is 2^(bits - 1).
inline std::string stream_of(const std::string& tables, int bits = 12) {
  return "\xff\xd8" + tables + frame(0xc3, bits) + kHuffmanTable + kScan + kEnd;
}

}  // namespace volsmooth::test
