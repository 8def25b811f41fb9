#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <numeric>

#include "algorithms/formats/zip_directory.h"
#include "algorithms/formats/zip_entry.h"
#include "algorithms/formats/zip_records.h"
#include "algorithms/formats/zip_writer.h"
#include "tests/support/bad_file.h"
#include "tests/support/child_process.h"
#include "tests/support/zip_maker.h"

namespace volsmooth {
namespace {

using test::BadFile;
using test::bytes_of_text;
using test::ByteVector;
using test::extra_field;
using test::zip64_field;
using test::ZipFile;
using test::ZipFileEntry;
using test::ZipHeaderFields;

ByteVector operator+(ByteVector front, const ByteVector& back) {
  front.insert(front.end(), back.begin(), back.end());
  return front;
}

using Contents = std::vector<std::pair<std::string, ByteVector>>;

/// What an archive holds, or the slug of its refusal.
tl::expected<Contents, Refusal> contents_of(const ByteVector& file, const ZipLimits& limits = {}) {
  const auto entries = read_zip_directory(file, limits);
  if (!entries) return tl::unexpected(entries.error());
  Contents contents;
  for (const ZipEntry& entry : *entries) {
    auto content = unpack(file, entry);
    if (!content) return tl::unexpected(content.error());
    contents.emplace_back(entry.name, *std::move(content));
  }
  return contents;
}

std::string slug_of(const ByteVector& file, const ZipLimits& limits = {}) {
  const auto contents = contents_of(file, limits);
  return contents ? "accepted" : contents.error().slug;
}

const ByteVector kContent = bytes_of_text("a slice, a slice, a slice, and another slice");

ZipFileEntry entry(const std::string& name = "slice", bool deflate = true) {
  return {name, kContent, deflate};
}

ByteVector archive_of(const ZipFileEntry& one) {
  return bytes_of(ZipFile{{entry("first"), one, entry("last")}});
}

/// An entry whose two headers were changed alike.
template <class Change>
ByteVector changed(const Change& change) {
  return archive_of(entry().both(change));
}

ByteVector named(std::string_view name) {
  return archive_of(entry(std::string(name)));
}

ByteVector with_mode(std::uint32_t mode) {
  ZipFileEntry one = entry();
  one.attributes = mode << 16;
  return archive_of(one);
}

ByteVector with_method(std::uint16_t method) {
  return changed([method](ZipHeaderFields& header) { header.method = method; });
}

ByteVector with_flag(std::uint16_t flag) {
  return changed([flag](ZipHeaderFields& header) { header.flags = flag; });
}

template <class Change>
ByteVector with_local(const Change& change) {
  ZipFileEntry one = entry();
  change(one.local);
  return archive_of(one);
}

template <class Change>
ByteVector with_end(const Change& change) {
  ZipFile zip{{entry()}};
  change(zip);
  return bytes_of(zip);
}

/// Two entries, of which the first's data reaches over the second's header ("quoted overlap").
ByteVector quoting_archive() {
  ZipFileEntry inner = entry("inner");
  ZipFile one{{inner}};
  const ByteVector whole = bytes_of(one);
  ByteVector local(whole.begin(), whole.begin() + 30 + 5 + static_cast<std::ptrdiff_t>(inner.packed.size()));
  ZipFileEntry outer("outer", local, false);
  const auto header_size = static_cast<std::uint32_t>(30 + outer.local.name.size());
  ZipFile zip{{outer, inner}};
  zip.entries[1].offset = header_size;  // the copy within the outer one's data
  ByteVector bytes = bytes_of(zip);
  return bytes;
}

ByteVector many_empty(std::size_t count) {
  ZipFile zip;
  for (std::size_t i = 0; i < count; ++i) zip.entries.emplace_back(std::to_string(i), ByteVector{}, false);
  zip.zip64 = [](auto numbers) { return numbers; };
  return bytes_of(zip);
}

ByteVector with_zip64_end(std::size_t which, std::uint64_t number) {
  return with_end([=](ZipFile& zip) {
    zip.zip64 = [=](auto numbers) {
      numbers[which] = number;
      return numbers;
    };
  });
}

ByteVector with_zip64_sizes(std::uint64_t size, std::uint64_t packed_size) {
  return changed([=](ZipHeaderFields& header) {
    header.size = header.packed_size = 0xffffffff;
    header.extra = zip64_field({size, packed_size});
  });
}

class RefusedZip : public testing::TestWithParam<BadFile> {};

TEST_P(RefusedZip, GetsItsSlug) {
  const auto contents = contents_of(GetParam().make());
  ASSERT_FALSE(contents.has_value());
  EXPECT_EQ(contents.error().slug, GetParam().slug) << contents.error().detail;
  EXPECT_FALSE(contents.error().detail.empty());
}

constexpr std::uint64_t kHuge = std::numeric_limits<std::uint64_t>::max();

const std::vector<BadFile> kBadZips{
    {"Z1_parent_folders", "zip-unsafe-name", [] { return named("../../etc/cron.d/x"); }},
    {"Z1_parent_folder_inside", "zip-unsafe-name", [] { return named("a/../../x"); }},
    {"Z1_parent_folder_last", "zip-unsafe-name", [] { return named("a/.."); }},
    {"Z1_absolute", "zip-unsafe-name", [] { return named("/abs"); }},
    {"Z1_drive", "zip-unsafe-name", [] { return named("C:/x"); }},
    {"Z1_drive_and_backslash", "zip-unsafe-name", [] { return named("C:\\x"); }},
    {"Z1_backslashes", "zip-unsafe-name", [] { return named("..\\..\\x"); }},
    {"Z1_empty", "zip-unsafe-name", [] { return named(""); }},
    {"Z2_symbolic_link", "zip-unsafe-entry", [] { return with_mode(0120777); }},
    {"Z2_device", "zip-unsafe-entry", [] { return with_mode(0020666); }},
    {"Z2_pipe", "zip-unsafe-entry", [] { return with_mode(0010644); }},
    {"Z2_file_that_is_a_folder", "zip-unsafe-entry", [] { return with_mode(0040755); }},
    {"Z2_hard_link_of_pkware", "zip-unsafe-entry",
     [] {
       return changed([](ZipHeaderFields& header) {
         header.extra = extra_field(0x000d, ByteVector(12) + bytes_of_text("first"));
       });
     }},
    {"Z2_link_of_asi", "zip-unsafe-entry",
     [] {
       return changed([](ZipHeaderFields& header) {
         header.extra = extra_field(0x756e, ByteVector(6) + bytes_of_text({"\5\0\0\0\0\0\0\0first", 13}));
       });
     }},
    {"Z3_nul", "zip-unsafe-name",
     [] {
       return named({"a\0b", 3});
     }},
    {"Z3_line_break", "zip-unsafe-name", [] { return named("a\nb"); }},
    {"Z3_delete", "zip-unsafe-name", [] { return named("a\x7f"); }},
    {"Z3_control_of_two_bytes", "zip-unsafe-name", [] { return named("a\xc2\x85"); }},
    {"Z3_65535_bytes", "zip-unsafe-name", [] { return named(std::string(65535, 'x')); }},
    {"Z3_not_utf8", "zip-unsafe-name", [] { return named("M\xfcller"); }},
    {"Z3_overlong_utf8", "zip-unsafe-name", [] { return named("\xc0\xae\xc0\xae/x"); }},
    {"Z3_cut_utf8", "zip-unsafe-name", [] { return named("a\xe2\x82"); }},
    {"Z3_surrogate", "zip-unsafe-name", [] { return named("\xed\xa0\x80"); }},
    {"Z3_beyond_unicode", "zip-unsafe-name", [] { return named("\xf4\x90\x80\x80"); }},
    {"Z3_right_to_left", "zip-unsafe-name",
     [] {
       return named(
           "a\xe2\x80\xae"
           "mcd.exe");
     }},
    {"Z5_same_header_twice", "zip-overlap",
     [] {
       ZipFile zip{{entry("slice"), entry("other")}};
       zip.entries[1].offset = 0;
       return bytes_of(zip);
     }},
    {"Z5_data_over_the_next_header", "zip-overlap",
     [] {
       ZipFileEntry one = entry("slice", false);
       one.both([](ZipHeaderFields& header) { header.packed_size = header.size = header.size + 9; });
       return archive_of(one);
     }},
    {"Z5_quoted_overlap", "zip-overlap", quoting_archive},
    {"Z6_size_too_small", "zip-corrupt",
     [] { return changed([](ZipHeaderFields& header) { header.size -= 1; }); }},
    {"Z6_size_too_large", "zip-corrupt",
     [] { return changed([](ZipHeaderFields& header) { header.size += 1; }); }},
    {"Z6_size_huge", "zip-corrupt",
     [] { return changed([](ZipHeaderFields& header) { header.size = 0xfffffffe; }); }},
    {"Z6_size_zero", "zip-corrupt", [] { return changed([](ZipHeaderFields& header) { header.size = 0; }); }},
    {"Z6_stored_size", "zip-corrupt",
     [] {
       return archive_of(entry("slice", false).both([](ZipHeaderFields& header) { header.size += 1; }));
     }},
    {"Z9_same_name", "zip-duplicate-entry", [] { return named("first"); }},
    {"Z9_case_twin", "zip-duplicate-entry", [] { return named("FIRST"); }},
    {"Z9_same_by_way_of_a_dot", "zip-duplicate-entry", [] { return named("./first"); }},
    {"Z10_encrypted", "zip-encrypted", [] { return with_flag(1); }},
    {"Z10_strongly_encrypted", "zip-encrypted", [] { return with_flag(1 << 6); }},
    {"Z10_masked_headers", "zip-encrypted", [] { return with_flag(1 << 13); }},
    {"Z11_bzip2", "zip-unsupported-method", [] { return with_method(12); }},
    {"Z11_lzma", "zip-unsupported-method", [] { return with_method(14); }},
    {"Z11_xz", "zip-unsupported-method", [] { return with_method(95); }},
    {"Z11_aes", "zip-unsupported-method", [] { return with_method(99); }},
    {"Z12_name", "zip-corrupt", [] { return with_local([](auto& header) { header.name = "slicE"; }); }},
    {"Z12_longer_name", "zip-corrupt", [] { return with_local([](auto& header) { header.name += "x"; }); }},
    {"Z12_method", "zip-corrupt", [] { return with_local([](auto& header) { header.method = 0; }); }},
    {"Z12_crc", "zip-corrupt", [] { return with_local([](auto& header) { header.crc ^= 1; }); }},
    {"Z12_size", "zip-corrupt", [] { return with_local([](auto& header) { header.size ^= 1; }); }},
    {"Z12_no_size", "zip-corrupt", [] { return with_local([](auto& header) { header.size = 0; }); }},
    {"Z12_packed_size", "zip-corrupt",
     [] { return with_local([](auto& header) { header.packed_size ^= 1; }); }},
    {"Z12_encrypted_locally", "zip-corrupt",
     [] { return with_local([](auto& header) { header.flags = 1; }); }},
    {"Z12_streamed_locally", "zip-corrupt",
     [] { return with_local([](auto& header) { header.flags = 8; }); }},
    {"Z12_no_local_header", "zip-corrupt",
     [] {
       ByteVector file = bytes_of(ZipFile{{entry()}});
       file[2] = std::byte{7};
       return file;
     }},
    {"Z12_wrong_data_descriptor", "zip-corrupt",
     [] {
       ZipFileEntry one = entry().streamed(true, false);
       one.behind[12] ^= std::byte{1};
       return archive_of(one);
     }},
    {"Z12_no_data_descriptor", "zip-corrupt",
     [] {
       ZipFileEntry one = entry().streamed(true, false);
       one.behind.clear();
       return archive_of(one);
     }},
    {"Z12_bytes_behind_the_data_descriptor", "zip-corrupt",
     [] {
       ZipFileEntry one = entry().streamed(false, false);
       one.behind.push_back(std::byte{0});
       return archive_of(one);
     }},
    {"Z13_empty_file", "zip-corrupt", [] { return ByteVector{}; }},
    {"Z13_no_end_record", "zip-corrupt",
     [] {
       ByteVector file = bytes_of(ZipFile{{entry()}});
       file.resize(file.size() - 22);
       return file;
     }},
    {"Z13_cut", "zip-corrupt",
     [] {
       ByteVector file = bytes_of(ZipFile{{entry()}});
       file.resize(file.size() / 2);
       return file;
     }},
    {"Z13_two_end_records", "zip-corrupt",
     [] {
       ByteVector file = bytes_of(ZipFile{{entry()}});
       file.insert(file.end(), file.end() - 22, file.end());
       return file;
     }},
    {"Z13_end_record_in_the_comment", "zip-corrupt",
     [] {
       const ByteVector other = bytes_of(ZipFile{});
       return with_end([&](ZipFile& zip) { zip.comment = other; });
     }},
    {"Z13_comment_of_64_kb", "zip-corrupt",
     [] { return with_end([](ZipFile& zip) { zip.comment = ByteVector(65535); }); }},
    {"Z13_prepended_bytes", "zip-corrupt",
     [] { return with_end([](ZipFile& zip) { zip.before = ByteVector(10); }); }},
    {"Z13_prepended_bytes_not_counted", "zip-corrupt",
     [] {
       return with_end([](ZipFile& zip) {
         zip.before = ByteVector(10);
         zip.offsets_count_before = false;
       });
     }},
    {"Z13_appended_bytes", "zip-corrupt",
     [] { return with_end([](ZipFile& zip) { zip.after = ByteVector(1); }); }},
    {"Z13_bytes_before_the_directory", "zip-corrupt",
     [] { return with_end([](ZipFile& zip) { zip.between = ByteVector(1); }); }},
    {"Z13_second_disk", "zip-corrupt", [] { return with_end([](ZipFile& zip) { zip.disk = 1; }); }},
    {"Z13_entry_on_another_disk", "zip-corrupt",
     [] { return with_end([](ZipFile& zip) { zip.entries[0].disk = 1; }); }},
    {"Z13_fewer_entries_than_it_says", "zip-corrupt",
     [] { return with_end([](ZipFile& zip) { zip.entry_count = std::uint16_t{2}; }); }},
    {"Z13_more_entries_than_it_says", "zip-corrupt",
     [] { return with_end([](ZipFile& zip) { zip.entry_count = std::uint16_t{0}; }); }},
    {"Z14_directory_beyond_the_file", "zip-corrupt", [] { return with_zip64_end(2, 1 << 20); }},
    {"Z14_directory_at_the_end_of_numbers", "zip-corrupt", [] { return with_zip64_end(2, kHuge); }},
    {"Z14_directory_that_wraps", "zip-corrupt", [] { return with_zip64_end(1, kHuge); }},
    {"Z14_header_beyond_the_file", "zip-corrupt",
     [] {
       ZipFileEntry one = entry();
       one.offset = 0xffffffff;
       one.record.extra = zip64_field({std::uint64_t{1} << 40});
       return archive_of(one);
     }},
    {"Z14_header_at_the_end_of_numbers", "zip-corrupt",
     [] {
       ZipFileEntry one = entry();
       one.offset = 0xffffffff;
       one.record.extra = zip64_field({kHuge});
       return archive_of(one);
     }},
    {"Z14_sizes_at_the_end_of_numbers", "zip-corrupt", [] { return with_zip64_sizes(kHuge, kHuge); }},
    {"Z14_packed_size_beyond_the_file", "zip-corrupt",
     [] { return with_zip64_sizes(kContent.size(), std::uint64_t{1} << 40); }},
    {"Z14_numbers_missing", "zip-corrupt",
     [] { return changed([](ZipHeaderFields& header) { header.size = 0xffffffff; }); }},
    {"Z15_crc", "zip-corrupt", [] { return changed([](ZipHeaderFields& header) { header.crc ^= 1; }); }},
    {"Z15_crc_of_stored", "zip-corrupt",
     [] { return archive_of(entry("slice", false).both([](auto& header) { header.crc ^= 1; })); }},
    {"deflate_reserved_block", "zip-corrupt",
     [] {
       ZipFileEntry one = entry();
       one.packed[0] = std::byte{7};
       return archive_of(one);
     }},
    {"deflate_ends_early", "zip-corrupt",
     [] {
       ZipFileEntry one = entry();
       one.packed.push_back(std::byte{0});
       one.both([](ZipHeaderFields& header) { header.packed_size += 1; });
       return archive_of(one);
     }},
    {"extra_field_runs_over", "zip-corrupt",
     [] { return changed([](ZipHeaderFields& header) {
            header.extra = bytes_of_text({"\1\2\7\0", 4});
          }); }},
    {"folder_with_content", "zip-corrupt",
     [] {
       ZipFileEntry one = entry("folder/");
       one.attributes = 0;
       return archive_of(one);
     }},
};

INSTANTIATE_TEST_SUITE_P(MaliciousInput, RefusedZip, testing::ValuesIn(kBadZips), test::name_of_row);

TEST(ZipLimits, EndAThousandfoldEntry) {  // Z7
  const ByteVector bomb = bytes_of(ZipFile{{{"zeros", ByteVector(8 << 20)}}});
  EXPECT_EQ(slug_of(bomb, {.free_unpacked_bytes = 1 << 20}), "decompression-limit");
  EXPECT_EQ(slug_of(bomb, {.max_inflate_ratio = 1100, .free_unpacked_bytes = 1 << 20}), "accepted");
}

TEST(ZipLimits, HoldForTheSumOfTheEntries) {  // Z7
  ZipFile zip;
  for (int i = 0; i < 4; ++i) zip.entries.push_back(entry(std::to_string(i)));
  const auto one = static_cast<std::int64_t>(kContent.size());
  EXPECT_EQ(slug_of(bytes_of(zip), {.max_unpacked_bytes = 4 * one - 1}), "decompression-limit");
  EXPECT_EQ(slug_of(bytes_of(zip), {.max_unpacked_bytes = 4 * one}), "accepted");
}

TEST(ZipLimits, EndTooManyEntries) {  // Z8
  EXPECT_EQ(slug_of(many_empty(70'000)), "zip-too-many-entries");
  EXPECT_EQ(slug_of(many_empty(300), {.max_entries = 299}), "zip-too-many-entries");
  EXPECT_EQ(slug_of(many_empty(300), {.max_entries = 300}), "accepted");
}

struct GoodZip {
  std::string name;
  std::function<ByteVector()> make;
};

class AcceptedZip : public testing::TestWithParam<GoodZip> {};

TEST_P(AcceptedZip, HoldsTheFile) {
  const auto contents = contents_of(GetParam().make());
  ASSERT_TRUE(contents.has_value()) << contents.error().slug << ": " << contents.error().detail;
  EXPECT_THAT(*contents, testing::Contains(testing::Field(&Contents::value_type::second, kContent)));
}

const std::vector<GoodZip> kGoodZips{
    {"deflated", [] { return archive_of(entry()); }},
    {"stored", [] { return archive_of(entry("slice", false)); }},
    {"streamed_with_signature", [] { return archive_of(entry().streamed(true, false)); }},  // macOS, Java
    {"streamed_without_signature", [] { return archive_of(entry().streamed(false, false)); }},
    {"streamed_in_zip64", [] { return archive_of(entry().streamed(true, true)); }},
    {"streamed_in_zip64_without_signature", [] { return archive_of(entry().streamed(false, true)); }},
    {"streamed_zip64_header",
     [] {
       ZipFileEntry one = entry().streamed(true, true);
       one.local.size = one.local.packed_size = 0xffffffff;
       one.local.extra = zip64_field({0, 0});
       return archive_of(one);
     }},
    {"zip64_sizes", [] { return with_zip64_sizes(kContent.size(), entry().packed.size()); }},
    {"zip64_offset",
     [] {
       ZipFile zip{{entry()}};
       zip.entries[0].offset = 0xffffffff;
       zip.entries[0].record.extra = zip64_field({0});
       return bytes_of(zip);
     }},
    {"zip64_end",
     [] { return with_end([](ZipFile& zip) { zip.zip64 = [](auto numbers) { return numbers; }; }); }},
    {"comment", [] { return with_end([](ZipFile& zip) { zip.comment = bytes_of_text("from the ward"); }); }},
    {"folders_and_umlauts", [] { return named("Schädel CT/Serie 1/slice"); }},
    {"no_mode", [] { return with_mode(0); }},
    {"other_extra_fields",
     [] {
       return changed([](ZipHeaderFields& header) {
         header.extra =
             extra_field(0x5455, ByteVector(5)) + extra_field(0x7875, ByteVector(11)) + ByteVector(3);
       });
     }},
    {"times_of_pkware",
     [] {
       return changed([](ZipHeaderFields& header) { header.extra = extra_field(0x000d, ByteVector(12)); });
     }},
    {"directory_in_another_order",
     [] {
       ZipFile zip{{entry("a"), entry("b", false)}};
       std::swap(zip.entries[0].record, zip.entries[1].record);
       zip.entries[0].offset = static_cast<std::uint32_t>(30 + 1 + zip.entries[0].packed.size());
       zip.entries[1].offset = 0;
       return bytes_of(zip);
     }},
};

INSTANTIATE_TEST_SUITE_P(AsWritersMakeThem, AcceptedZip, testing::ValuesIn(kGoodZips),
                         [](const auto& row) { return row.param.name; });

TEST(ZipDirectory, LeavesInnerArchivesAlone) {  // Z4
  const ByteVector inner = archive_of(entry());
  for (const bool deflate : {false, true}) {
    const auto contents = contents_of(bytes_of(ZipFile{{{"inner.zip", inner, deflate}}}));
    ASSERT_TRUE(contents.has_value()) << contents.error().detail;
    EXPECT_THAT(*contents, testing::ElementsAre(testing::Pair("inner.zip", inner)));
  }
}

TEST(ZipDirectory, LeavesOutFolders) {
  ZipFile zip{{{"folder/", {}, false}, entry("folder/slice")}};
  zip.entries[0].attributes = 0040755U << 16 | 0x10;
  const auto entries = read_zip_directory(bytes_of(zip));
  ASSERT_TRUE(entries.has_value()) << entries.error().detail;
  EXPECT_THAT(*entries, testing::ElementsAre(testing::Field(&ZipEntry::name, "folder/slice")));
}

TEST(ZipDirectory, OfAnArchiveOfNothingIsEmpty) {
  EXPECT_THAT(read_zip_directory(bytes_of(ZipFile{})).value(), testing::IsEmpty());
}

TEST(ZipDirectory, IsToldByTheFirstBytes) {
  EXPECT_TRUE(looks_like_zip(archive_of(entry())));
  EXPECT_TRUE(looks_like_zip(bytes_of(ZipFile{})));
  EXPECT_FALSE(looks_like_zip(bytes_of_text("PK")));
  EXPECT_FALSE(looks_like_zip(bytes_of(test::NiftiFile{})));
}

/// No cut and no changed byte does any harm; sanitizers watch.
TEST(ZipDirectory, SurvivesEveryChangedByteAndEveryCut) {
  ZipFile zip{{entry("a"), entry("b", false).streamed(true, true)}};
  zip.zip64 = [](auto numbers) { return numbers; };
  const ByteVector good = bytes_of(zip);
  for (std::size_t at = 0; at < good.size(); ++at) {
    EXPECT_EQ(slug_of({good.begin(), good.begin() + static_cast<std::ptrdiff_t>(at)}), "zip-corrupt");
    for (const int change : {0x01, 0x80, 0xff}) {
      ByteVector bad = good;
      bad[at] ^= std::byte(change);
      (void)contents_of(bad);
    }
  }
}

ByteVector written(const Contents& contents) {
  ByteVector file;
  ZipWriter writer(
      [&](std::span<const std::byte> bytes) { file.insert(file.end(), bytes.begin(), bytes.end()); });
  for (const auto& [name, content] : contents) writer.add(name, pack(content));
  writer.finish();
  return file;
}

/// Bytes that deflate cannot make smaller.
ByteVector noise(std::size_t size) {
  ByteVector bytes(size);
  std::uint64_t state = 1;
  for (std::byte& byte : bytes) {
    state = state * 6364136223846793005U + 1442695040888963407U;
    byte = std::byte(state >> 56);
  }
  return bytes;
}

const Contents kSeries{{"series/1.dcm", kContent},
                       {"series/2.dcm", noise(200'000)},
                       {"series/3.dcm", ByteVector(300'000)},
                       {"series/4.dcm", {}}};

/// Leaves bytes behind for what is not initialised in the calls that follow.
[[gnu::noinline]] void dirty_the_stack(std::uint16_t number) {
  std::array<std::uint16_t, 1 << 17> remains;
  remains.fill(number);
  asm volatile("" : : "r"(remains.data()) : "memory");
}

TEST(ZipWriter, PacksAlikeWhateverWasInMemory) {
  ByteVector content;
  for (int word = 0; word < 3000; ++word)
    for (const char digit : std::to_string(word * 7919 % 211))
      content.push_back(static_cast<std::byte>(digit));
  const ByteVector packed = pack(content).deflated;
  for (const std::uint16_t number : std::array<std::uint16_t, 6>{1, 5, 8, 11, 14, 0xffff}) {
    dirty_the_stack(number);
    EXPECT_EQ(pack(content).deflated, packed) << number;
  }
}

TEST(ZipWriter, WritesWhatTheReaderReads) {
  const auto contents = contents_of(written(kSeries));
  ASSERT_TRUE(contents.has_value()) << contents.error().detail;
  EXPECT_EQ(*contents, kSeries);
}

TEST(ZipWriter, WritesMoreEntriesThanTheShortRecordCanCount) {
  Contents many;
  for (int i = 0; i < 65'535; ++i) many.emplace_back(std::to_string(i), ByteVector{});
  const auto entries = read_zip_directory(written(many));
  ASSERT_TRUE(entries.has_value()) << entries.error().detail;
  EXPECT_EQ(entries->size(), many.size());
}

TEST(ZipWriter, HasRecordsForEntriesBeyond4GiB) {
  for (const std::uint64_t offset : {0xfffffffeULL, 0xffffffffULL, 0x123456789aULL}) {
    ZipHeader far;
    far.name = "far";
    far.header_offset = offset;
    const auto read = directory_record(directory_record_bytes(far));
    ASSERT_TRUE(read.has_value());
    EXPECT_EQ(read->header_offset, offset);
    EXPECT_EQ(read->name, "far");
  }
}

bool installed(const std::string& program) {
  return std::filesystem::exists(program);
}

int run(const std::vector<std::string>& command, const std::filesystem::path& output) {
  return test::ChildProcess(command, output, output).wait();
}

TEST(ZipWriter, WritesWhatUnzipReads) {
  if (!installed("/usr/bin/unzip")) GTEST_SKIP() << "no unzip";
  const test::TemporaryDirectory folder;
  const test::TemporaryFile archive(written(kSeries));
  EXPECT_EQ(run({"/usr/bin/unzip", archive.path(), "-d", folder / "out"}, folder / "said"), 0)
      << test::content_of(folder / "said");
  for (const auto& [name, content] : kSeries)
    EXPECT_EQ(bytes_of_text(test::content_of(folder / "out" / name)), content) << name;
}

TEST(ZipDirectory, ReadsWhatZipWrites) {
  if (!installed("/usr/bin/zip")) GTEST_SKIP() << "no zip";
  const test::TemporaryDirectory folder;
  std::filesystem::create_directory(folder / "series");
  for (const auto& [name, content] : kSeries)
    std::ofstream(folder / name, std::ios::binary)
        .write(reinterpret_cast<const char*>(content.data()), static_cast<std::streamsize>(content.size()));
  const auto zip_in_folder = [&](const std::string& options, const std::string& target) {
    return run({"/bin/sh", "-c",
                "cd '" + folder.path().string() + "' && zip -r " + options + " - series > " + target},
               folder / "said");
  };
  for (const std::string options : {"", "-0", "-fz-"}) {
    ASSERT_EQ(zip_in_folder(options, "a.zip"), 0) << test::content_of(folder / "said");
    const auto contents = contents_of(bytes_of_text(test::content_of(folder / "a.zip")));
    ASSERT_TRUE(contents.has_value()) << contents.error().detail;
    EXPECT_THAT(*contents, testing::UnorderedElementsAreArray(kSeries)) << options;
  }
}

TEST(ZipDirectory, ReadsWhatPythonWrites) {
  if (!installed("/usr/bin/python3")) GTEST_SKIP() << "no Python";
  const test::TemporaryDirectory folder;
  const std::string script =
      "import sys, zipfile\n"
      "class Pipe:\n"
      "  def __init__(self, file): self.write, self.flush = file.write, file.flush\n"
      "with open(sys.argv[1], 'wb') as file:\n"
      "  with zipfile.ZipFile(Pipe(file), 'w', zipfile.ZIP_DEFLATED) as archive:\n"
      "    with archive.open('streamed', 'w', force_zip64=True) as out: out.write(b'x' * 100000)\n"
      "    archive.writestr('stored', b'y' * 1000, zipfile.ZIP_STORED)\n";
  ASSERT_EQ(run({"/usr/bin/python3", "-c", script, folder / "a.zip"}, folder / "said"), 0)
      << test::content_of(folder / "said");
  const auto contents = contents_of(bytes_of_text(test::content_of(folder / "a.zip")));
  ASSERT_TRUE(contents.has_value()) << contents.error().detail;
  EXPECT_EQ(*contents, (Contents{{"streamed", ByteVector(100'000, std::byte{'x'})},
                                 {"stored", ByteVector(1000, std::byte{'y'})}}));
}

}  // namespace
}  // namespace volsmooth
