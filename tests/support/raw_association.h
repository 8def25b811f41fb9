#pragma once

#include <cstddef>
#include <string>

namespace volsmooth::test {

// What a peer says of itself, byte by byte (DICOM PS3.8, 9.3).

/// An item or a PDU: a type, a byte of nothing, and the length of what follows, the highest byte first.
inline std::string tlv(char type, int length_bytes, const std::string& content) {
  std::string text{type, '\0'};
  for (int i = length_bytes; i-- > 0;) text += static_cast<char>(content.size() >> (8 * i) & 0xFF);
  return text + content;
}

/// An A-ASSOCIATE-RQ or -AC whose only presentation context is that item.
inline std::string association_pdu(char type, const std::string& context) {
  const auto title = [](std::string text) { return text.append(16 - text.size(), ' '); };
  const std::string maximum = tlv(0x51, 2, std::string("\0\0\x40\0", 4)) + tlv(0x52, 2, "1.2.3.4");
  return tlv(type, 4,
             std::string("\0\1\0\0", 4) + title("HEAD") + title("RAW") + std::string(32, '\0') +
                 tlv(0x10, 2, "1.2.840.10008.3.1.1.1") + context + tlv(0x50, 2, maximum));
}

/// An A-ASSOCIATE-RQ for HEAD that proposes Verification.
inline std::string association_request() {
  return association_pdu(1, tlv(0x20, 2,
                                std::string("\1\0\0\0", 4) + tlv(0x30, 2, "1.2.840.10008.1.1") +
                                    tlv(0x40, 2, "1.2.840.10008.1.2")));
}

/// An A-ASSOCIATE-AC that takes the first context, in Implicit VR.
inline std::string association_acceptance() {
  return association_pdu(2, tlv(0x21, 2, std::string("\1\0\0\0", 4) + tlv(0x40, 2, "1.2.840.10008.1.2")));
}

/// A C-ECHO-RQ (PS3.7, 9.3.5) in a P-DATA-TF.
inline std::string echo_request() {
  const std::string command(
      "\0\0\0\0\4\0\0\0\x38\0\0\0"
      "\0\0\2\0\x12\0\0\0"
      "1.2.840.10008.1.1\0"
      "\0\0\0\1\2\0\0\0\x30\0"
      "\0\0\x10\1\2\0\0\0\1\0"
      "\0\0\0\x8\2\0\0\0\1\1",
      68);
  std::string fragment(3, '\0');
  fragment += static_cast<char>(command.size() + 2);
  return tlv(4, 4, fragment + "\1\3" + command);
}

inline std::string release_request() {
  return tlv(5, 4, std::string(4, '\0'));
}

}  // namespace volsmooth::test
