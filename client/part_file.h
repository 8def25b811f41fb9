#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "client/descriptor.h"
#include "client/failure.h"

namespace volsmooth {

/// A file under a temporary name beside its final one: hashed while it is written, gone when dropped
/// unpublished.
class PartFile {
 public:
  static Expected<PartFile> create(const std::filesystem::path& final_path);
  PartFile(PartFile&&) noexcept = default;
  ~PartFile();

  Expected<void> write(std::string_view bytes);

  /// Ends writing; kInternal unless it is `bytes` long and has this SHA-256 (hex).
  Expected<void> finish(std::int64_t bytes, std::string_view sha256);

  /// Gives it its final name. Without `overwrite` a file that has the name already is left alone
  /// (kCannotWrite).
  Expected<std::filesystem::path> publish(bool overwrite);

 private:
  struct HashDeleter {
    void operator()(void* context) const;
  };

  PartFile(std::filesystem::path final_path, std::string temporary, Descriptor descriptor);
  Failure cannot_write(int error) const;

  std::filesystem::path final_path_;
  std::string temporary_;  ///< empty: published or moved from
  Descriptor descriptor_;
  std::unique_ptr<void, HashDeleter> hash_;
  std::int64_t bytes_ = 0;
};

}  // namespace volsmooth
