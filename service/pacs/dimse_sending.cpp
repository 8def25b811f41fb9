#include "service/pacs/dimse_sending.h"

#include <cerrno>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <optional>
#include <set>
#include <system_error>
#include <thread>

#include "service/pacs/dimse_answers.h"
#include "service/pacs/dimse_child.h"
#include "service/pacs/instances.h"

namespace volsmooth {
namespace {

using nlohmann::json;

/// Beyond the limits that volsmooth-dimse keeps itself.
constexpr std::chrono::seconds kAssociationPatience{120}, kResponsePatience{300};
constexpr std::size_t kSlowestBytesPerSecond = std::size_t{64} << 10;

json association_for(const DimsePeer& peer, std::span<const DicomInstance> instances) {
  std::set<std::string> sop_classes;
  for (const DicomInstance& instance : instances) sop_classes.insert(instance.sop_class_uid);
  json association{{"host", peer.host},
                   {"port", peer.port},
                   {"called", peer.called},
                   {"calling", peer.calling},
                   {"sop_classes", sop_classes}};
  if (peer.tls) association["tls"] = document_of(*peer.tls);
  return association;
}

/// Asks ten times a second whether to go on, and kills the child when not: whoever waits for it, in whatever
/// state, is then told that it is gone.
class Watch {
 public:
  Watch(const DimseChild& child, const std::function<void()>& keep_going)
      : thread_([this, &child, &keep_going](const std::stop_token& over) { run(over, child, keep_going); }) {}

  /// Throws what `keep_going` did.
  void end() {
    thread_.request_stop();
    if (thread_.joinable()) thread_.join();
    if (thrown_) std::rethrow_exception(std::exchange(thrown_, nullptr));
  }

 private:
  void run(const std::stop_token& over, const DimseChild& child, const std::function<void()>& keep_going) {
    constexpr std::chrono::milliseconds kPause{100};
    std::mutex mutex;
    std::condition_variable_any woken;
    std::unique_lock lock(mutex);
    try {
      while (!over.stop_requested()) {
        keep_going();
        woken.wait_for(lock, over, kPause, [] { return false; });
      }
    } catch (...) {
      thrown_ = std::current_exception();
      child.kill();
    }
  }

  std::exception_ptr thrown_;
  std::jthread thread_;  // last: it uses the above
};

/// One association, from the request on.
class Storing {
 public:
  Storing(const Node& node, std::span<const DicomInstance> instances, DimseChild& child)
      : node_(node), child_(child), channel_(child_.channel()) {
    channel_.send(association_for(*node.dimse, instances));
  }

  tl::expected<void, NodeFailure> opened() {
    const json told = channel_.receive_document(kAssociationPatience);
    if (told.contains("failure")) return tl::unexpected(failure_from(node_, told));
    return {};
  }

  tl::expected<InstanceAnswer, NodeFailure> store(const DicomInstance& instance,
                                                  std::span<const std::byte> bytes) {
    channel_.send_bytes(bytes);
    channel_.send({{"sop_class", instance.sop_class_uid}, {"sop_instance", instance.sop_instance_uid}});
    const json told = channel_.receive_document(kResponsePatience +
                                                std::chrono::seconds(bytes.size() / kSlowestBytesPerSecond));
    constexpr std::uint16_t kClassNotSupported = 0x0122;
    if (told.value("failure", "") == "not-accepted")
      return outcome_of(node_, instance.sop_instance_uid, kClassNotSupported);
    if (told.value("failure", "") == "unreadable")
      return InstanceAnswer{instance.sop_instance_uid, false, "it cannot be read any more"};
    if (told.contains("failure")) return tl::unexpected(failure_from(node_, told));
    return outcome_of(node_, instance.sop_instance_uid, told.at("status").get<std::uint16_t>());
  }

  void finish() { child_.finish(); }

 private:
  const Node& node_;
  DimseChild& child_;
  Channel channel_;
};

/// False: there is no room for it just now.
bool start(std::optional<DimseChild>& child) {
  try {
    child.emplace("send");
    return true;
  } catch (const std::system_error& error) {
    for (const int passing : {EAGAIN, ENOMEM, EMFILE, ENFILE})
      if (error.code() == std::error_code(passing, std::generic_category())) return false;
    throw;
  }
}

tl::expected<void, NodeFailure> store_through(
    DimseChild& child, const Node& node, const std::filesystem::path& file,
    std::span<const DicomInstance> instances,
    const std::function<void(std::span<const InstanceAnswer>)>& on_answers) {
  std::set<std::string> wanted;
  for (const DicomInstance& instance : instances) wanted.insert(instance.sop_instance_uid);
  try {
    Storing storing(node, instances, child);
    if (auto opened = storing.opened(); !opened) return opened;
    std::optional<NodeFailure> failure;
    for_each_instance(file, [&](const DicomInstance& instance, std::span<const std::byte> bytes) {
      if (failure || !wanted.contains(instance.sop_instance_uid)) return;
      if (const auto answer = storing.store(instance, bytes)) {
        on_answers(std::span(&*answer, 1));
      } else {
        failure = answer.error();
      }
    });
    if (failure) return tl::unexpected(*std::move(failure));
    storing.finish();
    return {};
  } catch (const ChannelError&) {
    return tl::unexpected(connection_lost(node));
  } catch (const json::exception&) {  // it says what it must not
    return tl::unexpected(connection_lost(node));
  }
}

}  // namespace

tl::expected<void, NodeFailure> store_instances(
    const Node& node, const std::filesystem::path& file, std::span<const DicomInstance> instances,
    const std::function<void(std::span<const InstanceAnswer>)>& on_answers,
    const std::function<void()>& keep_going) {
  std::optional<DimseChild> child;
  if (!start(child)) return tl::unexpected(not_started(node));
  Watch watch(*child, keep_going);
  auto sent = store_through(*child, node, file, instances, on_answers);
  watch.end();
  return sent;
}

}  // namespace volsmooth
