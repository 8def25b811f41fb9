#pragma once

#include <gdcmDataSet.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace volsmooth {

/// A coded concept (PS3.3, section 8.8).
struct DicomCode {
  std::string value, scheme, meaning;
};

/// A reference to another object.
struct InstanceReference {
  std::string sop_class_uid, sop_instance_uid;
};

// GDCM's data sets in few words. Values take the place of those that were there. `tag` is group and element,
// as 0x00100010.

void set_text(gdcm::DataSet& set, std::uint32_t tag, gdcm::VR vr, std::string_view value);
/// Numbers of the size that `vr` has, or other bytes.
void set_bytes(gdcm::DataSet& set, std::uint32_t tag, gdcm::VR vr, std::span<const std::byte> bytes);
void set_sequence(gdcm::DataSet& set, std::uint32_t tag, const std::vector<gdcm::DataSet>& items);
void set_code(gdcm::DataSet& set, std::uint32_t sequence, const DicomCode& code);
void remove(gdcm::DataSet& set, std::uint32_t tag);

void set_us(gdcm::DataSet& set, std::uint32_t tag, std::uint16_t value);
void set_ul(gdcm::DataSet& set, std::uint32_t tag, std::uint32_t value);
template <class T>
void set_array(gdcm::DataSet& set, std::uint32_t tag, gdcm::VR vr, std::span<const T> values) {
  set_bytes(set, tag, vr, std::as_bytes(values));
}

bool has(const gdcm::DataSet& set, std::uint32_t tag);             ///< also when it is empty
std::string text_of(const gdcm::DataSet& set, std::uint32_t tag);  ///< without padding
std::vector<gdcm::DataSet> items_of(const gdcm::DataSet& set, std::uint32_t tag);

/// An item that refers to an object: SOP Instance Reference Macro (PS3.3, table 10-11).
gdcm::DataSet reference_item(const InstanceReference& reference);

/// The attributes of the data set up to its pixels, each with its VR; private ones, those that the dictionary
/// does not know, and group lengths left out, in sequences as well. `part10`: a walked file, not deflated.
/// Throws Refused: dicom-decode-failed.
gdcm::DataSet public_attributes(std::span<const std::byte> part10);

/// The header of an element of one of the VRs with four bytes of length, for the end of a file.
void append_long_header(std::vector<std::byte>& file, std::uint32_t tag, std::string_view vr,
                        std::uint32_t length);

/// A Part 10 file of the data set in Explicit VR Little Endian, with an empty preamble.
std::vector<std::byte> part10_file(const gdcm::DataSet& set);

}  // namespace volsmooth
