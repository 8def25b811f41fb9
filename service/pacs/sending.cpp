#include "service/pacs/sending.h"

#include <algorithm>
#include <map>
#include <set>

#include "service/pacs/hexadecimal.h"
#include "service/pacs/instances.h"

namespace volsmooth {
namespace {

using nlohmann::json;

constexpr long kAccepted = 202, kConflict = 409;
constexpr std::size_t kBatchBytes = std::size_t{16} << 20;
const std::string kBoundary = "volsmooth-5dd7f1a2c4e94f0b";

// Tags of PS3.18, table 10.5.3-1, as DICOM JSON writes them.
const char* const kReferenced = "00081199";
const char* const kFailed = "00081198";
const char* const kInstanceUid = "00081155";
const char* const kFailureReason = "00081197";

json first_value(const json& item, const char* tag) {
  const auto element = item.find(tag);
  if (element == item.end()) return nullptr;
  const auto values = element->find("Value");
  return values == element->end() || !values->is_array() || values->empty() ? json() : values->front();
}

const json& items_of(const json& document, const char* tag) {
  static const json none = json::array();
  const auto element = document.find(tag);
  if (element == document.end() || !element->is_object()) return none;
  const auto values = element->find("Value");
  return values == element->end() || !values->is_array() ? none : *values;
}

std::string text_of_reason(const json& reason) {
  if (!reason.is_number_integer()) return "no reason given";
  return hexadecimal(static_cast<std::uint16_t>(reason.get<unsigned>() & 0xFFFFU));
}

/// The instances of a request and their body.
class Batch {
 public:
  void add(const DicomInstance& instance, std::span<const std::byte> bytes) {
    uids_.push_back(instance.sop_instance_uid);
    body_ += "--" + kBoundary + "\r\nContent-Type: application/dicom\r\n\r\n";
    body_.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    body_ += "\r\n";
  }

  bool empty() const { return uids_.empty(); }
  bool full() const { return body_.size() >= kBatchBytes; }

  tl::expected<std::vector<InstanceAnswer>, NodeFailure> send(const Node& node,
                                                              const std::function<void()>& keep_going) {
    body_ += "--" + kBoundary + "--\r\n";
    NodeRequest request{"/studies",
                        {"Content-Type: multipart/related; type=\"application/dicom\"; boundary=" + kBoundary,
                         "Accept: application/dicom+json"}};
    request.body = &body_;
    request.keep_going = keep_going;
    const auto answer = exchange(node, request);
    if (!answer) return tl::unexpected(answer.error());
    if (answer->status != kOk && answer->status != kAccepted && answer->status != kConflict)
      return tl::unexpected(failure_of_status(node, answer->status));
    return answers_from(*answer, uids_);
  }

 private:
  std::vector<std::string> uids_;
  std::string body_;
};

}  // namespace

std::vector<InstanceAnswer> answers_from(const NodeAnswer& answer, std::span<const std::string> sent_uids) {
  const auto document = json::parse(answer.body, nullptr, false);
  std::set<std::string> stored;
  std::map<std::string, std::string> refused;
  if (document.is_object()) {
    for (const json& item : items_of(document, kReferenced))
      if (const json uid = first_value(item, kInstanceUid); uid.is_string()) stored.insert(uid);
    for (const json& item : items_of(document, kFailed))
      if (const json uid = first_value(item, kInstanceUid); uid.is_string())
        refused[uid] = text_of_reason(first_value(item, kFailureReason));
  }
  std::vector<InstanceAnswer> answers;
  for (const std::string& uid : sent_uids) {
    if (const auto found = refused.find(uid); found != refused.end()) {
      answers.push_back({uid, false, found->second});
    } else if (stored.contains(uid) || answer.status == kOk) {
      // 200 says that all are stored, also when the node lists none of them.
      answers.push_back({uid, true, {}});
    } else {
      answers.push_back({uid, false, "the node did not say that it has it"});
    }
  }
  return answers;
}

tl::expected<void, NodeFailure> send_instances(
    const Node& node, const std::filesystem::path& file, std::span<const DicomInstance> instances,
    const std::function<void(std::span<const InstanceAnswer>)>& on_answers,
    const std::function<void()>& keep_going) {
  std::set<std::string> wanted;
  for (const DicomInstance& instance : instances) wanted.insert(instance.sop_instance_uid);
  Batch batch;
  std::optional<NodeFailure> failure;
  const auto send = [&] {
    if (const auto answers = std::exchange(batch, {}).send(node, keep_going)) {
      on_answers(*answers);
    } else {
      failure = answers.error();
    }
  };
  for_each_instance(file, [&](const DicomInstance& instance, std::span<const std::byte> bytes) {
    if (failure || !wanted.contains(instance.sop_instance_uid)) return;
    batch.add(instance, bytes);
    if (batch.full()) send();
  });
  if (!failure && !batch.empty()) send();
  if (failure) return tl::unexpected(*std::move(failure));
  return {};
}

}  // namespace volsmooth
