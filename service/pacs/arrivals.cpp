#include "service/pacs/arrivals.h"

#include <algorithm>
#include <span>

namespace volsmooth {
namespace {

constexpr std::uint16_t kSuccess = 0x0000, kOutOfResources = 0xA700, kCannotUnderstand = 0xC000;
constexpr std::uint16_t kOtherThanAnnounced = 0xB007;  ///< a warning: it is stored

}  // namespace

std::uint16_t status_of(const Problem& problem) {
  constexpr const char* kOfResources[] = {"insufficient-storage", "not-ready", "queue-full", "quota"};
  const bool of_resources = std::ranges::find(kOfResources, problem.slug) != std::end(kOfResources);
  return of_resources || problem.is_passing ? kOutOfResources : kCannotUnderstand;
}

void Arrivals::take(std::string_view bytes) {
  if (refused_) return;
  try {
    write(bytes);
  } catch (const std::exception&) {  // the disk, or its room
    refused_ = kOutOfResources;
  }
  if (refused_) file_.reset();
}

void Arrivals::write(std::string_view bytes) {
  if (!file_) {
    auto begun = inbox_.begin();
    if (!begun) {
      refused_ = status_of(begun.error());
      return;
    }
    file_ = *std::move(begun);
  }
  if (file_->bytes() + std::ssize(bytes) > inbox_.max_bytes) {
    refused_ = kCannotUnderstand;  // another try would not make it smaller
  } else {
    file_->write(std::as_bytes(std::span(bytes)));
  }
}

std::uint16_t Arrivals::keep(const std::string& preset, const std::string& sop_class,
                             const std::string& sop_instance) {
  if (refused_) return *std::exchange(refused_, std::nullopt);
  if (!file_) return kCannotUnderstand;
  try {
    const auto kept = inbox_.keep(preset, *std::exchange(file_, std::nullopt));
    if (!kept) return status_of(kept.error());
    const auto is_announced = [&](const ArrivedInstance& one) {
      return one.sop_class_uid == sop_class && one.sop_instance_uid == sop_instance;
    };
    return std::ranges::all_of(*kept, is_announced) ? kSuccess : kOtherThanAnnounced;
  } catch (const std::exception&) {  // the store: the device may try again
    return kOutOfResources;
  }
}

}  // namespace volsmooth
