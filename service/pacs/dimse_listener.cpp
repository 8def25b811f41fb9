#include "service/pacs/dimse_listener.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <stdexcept>

#include "service/pacs/ae_title.h"
#include "service/pacs/configured.h"
#include "service/pacs/dimse_answers.h"
#include "service/pacs/dimse_child.h"

namespace volsmooth {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

constexpr std::size_t kAssociations = 32;
constexpr int kVerifying = 2;  ///< instances at the same time, as many as by HTTP
constexpr auto kLook = 100ms;  ///< how often a stop is looked for
// Beyond the limits that volsmooth-dimse keeps itself.
constexpr auto kRequestPatience = 60s, kIdlePatience = 330s;

constexpr std::uint32_t kAccepted = 0, kNoSuchTitle = 0x0107, kNoSuchCaller = 0x0103;
/// An A-ASSOCIATE-RJ: transient, by the presentation service, local limit exceeded (DICOM PS3.8, 9.3.4).
constexpr char kBusy[] = {3, 0, 0, 0, 0, 4, 0, 2, 3, 2};
/// Permanent, by the service user: kNoSuchCaller.
constexpr char kStranger[] = {3, 0, 0, 0, 0, 4, 0, 1, 1, 3};

/// Without the spaces that say nothing.
std::string title_in(const json& request, const char* member) {
  std::string title = request.at(member);
  while (title.ends_with(' ')) title.pop_back();
  title.erase(0, title.find_first_not_of(' '));
  return title;
}

/// "--dimse-tls-ca" of "ca_file".
std::string option_of(const std::string& member) {
  return "--dimse-tls-" + member.substr(0, member.find('_'));
}

/// What is no AE title stays out of the log.
std::string logged(const std::string& title) {
  return is_ae_title(title) ? title : "?";
}

}  // namespace

struct DimseListener::Served {
  Served(int connection, const boost::asio::ip::address_v4& from)
      : address(from), child("receive", connection) {}
  const boost::asio::ip::address_v4 address;
  DimseChild child;
  std::atomic<bool> has_ended = false;
  std::jthread thread = {};  // joined before the child goes
};

struct DimseListener::Tally {
  std::string called = "?", calling = "?";
  int stored = 0, refused = 0;
  bool is_stranger = false;
};

std::map<std::string, CalledPreset> presets_by_title(const std::vector<Preset>& presets) {
  std::map<std::string, CalledPreset> found;
  for (const Preset& preset : presets) {
    if (preset.aet.empty())
      refuse_preset(preset.name, "its name is too long for an AE title; give it one as 'aet'");
    if (const auto [other, is_new] = found.try_emplace(preset.aet, preset.name, Callers(preset)); !is_new)
      throw std::runtime_error("configuration: the presets '" + other->second.name + "' and '" + preset.name +
                               "' have the same AE title, " + preset.aet);
  }
  return found;
}

DimseListener::DimseListener(Settings settings, Inbox inbox)
    : settings_(std::move(settings)),
      inbox_(std::move(inbox)),
      listening_(
          listen_for_dimse(settings_.listen, settings_.allow_open_network || settings_.tls.has_value())),
      verifying_(kVerifying) {
  if (settings_.presets.empty())
    throw std::runtime_error("--dimse-listen needs presets in the configuration: their AE titles are called");
  dimse_program();
  if (settings_.tls)
    check(*settings_.tls, [](const std::string& member, const std::string& why) {
      throw std::runtime_error(option_of(member) + " cannot be used: " + why);
    });
  accepting_ = std::jthread([this](const std::stop_token& stopped) { accept_all(stopped); });
}

DimseListener::~DimseListener() {
  accepting_.request_stop();
  if (accepting_.joinable()) accepting_.join();
  for (const Served& served : served_) served.child.kill();
  served_.clear();  // their threads use the rest
}

void DimseListener::accept_all(const std::stop_token& stopped) {
  while (!stopped.stop_requested()) {
    served_.remove_if([](const Served& served) { return served.has_ended.load(); });
    turned_away_.look();
    pollfd polled{listening_.socket.get(), POLLIN, 0};
    if (::poll(&polled, 1, static_cast<int>(kLook.count())) <= 0) continue;
    sockaddr_in peer{};
    socklen_t size = sizeof peer;
    FileDescriptor connection(
        ::accept4(listening_.socket.get(), reinterpret_cast<sockaddr*>(&peer), &size, SOCK_CLOEXEC));
    if (connection.get() < 0) {
      std::this_thread::sleep_for(kLook);  // no descriptors are left, or it went away again
      continue;
    }
    try {
      begin(std::move(connection), boost::asio::ip::address_v4(ntohl(peer.sin_addr.s_addr)));
    } catch (const std::exception& error) {
      settings_.log_error("dimse-fault", error.what());
    }
  }
}

void DimseListener::log_fruitless(const Settings::Log& log, const std::string& line) {
  if (const auto others = fruitless_.admit()) log("dimse-association", line + *others);
}

/// Who comes from where no preset expects anybody gets neither a process nor one of the places.
void DimseListener::begin(FileDescriptor connection, const boost::asio::ip::address_v4& address) {
  const auto expects = [&](const auto& preset) { return preset.second.callers.may_come_from(address); };
  if (std::ranges::none_of(settings_.presets, expects)) {
    log_fruitless(settings_.log_warning, "rejected: " + address.to_string() + " may not call");
    settings_.on_stranger("");
    turned_away_.add(std::move(connection), {kStranger, sizeof kStranger});
    return;
  }
  if (served_.size() >= kAssociations) {
    turned_away_.add(std::move(connection), {kBusy, sizeof kBusy});
    return;
  }
  const int yes = 1;
  ::setsockopt(connection.get(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  Served& served = served_.emplace_back(connection.get(), address);
  try {
    served.thread = std::jthread([this, &served] {
      serve(served);
      served.has_ended = true;
    });
  } catch (...) {
    served_.pop_back();
    throw;
  }
}

void DimseListener::serve(Served& served) {
  Tally tally;
  std::string end = "broken off";
  bool broken_off = false;
  try {
    end = talk(served, tally);
  } catch (const std::exception&) {  // its volsmooth-dimse is gone, or says what it must not
    broken_off = true;
  }
  const auto& log =
      broken_off || tally.is_stranger || tally.refused > 0 ? settings_.log_warning : settings_.log;
  const std::string line = "from " + tally.calling + " to " + tally.called + ": " +
                           std::to_string(tally.stored) + " stored, " + std::to_string(tally.refused) +
                           " refused, " + end;
  if (tally.stored > 0) {
    log("dimse-association", line);
  } else {
    log_fruitless(log, line);
  }
}

/// How it ended.
std::string DimseListener::talk(Served& served, Tally& tally) {
  Channel channel = served.child.channel();
  channel.send(settings_.tls ? json{{"tls", document_of(*settings_.tls)}} : json::object());
  const json request = channel.receive_document(kRequestPatience);
  if (request.value("failure", "") == "tls") {
    tally.is_stranger = true;
    settings_.on_stranger("");
    return "rejected: " + served.address.to_string() + " does not speak TLS, or nobody vouches for it";
  }
  if (request.contains("failure")) return "broken off by a fault of the service's";
  const std::string calling = title_in(request, "calling"), called = title_in(request, "called");
  tally.calling = logged(calling);
  tally.called = logged(called);
  const auto preset = settings_.presets.find(called);
  const auto reject = [&](std::uint32_t reason) {
    channel.send({{"reject", reason}});
    channel.receive(kRequestPatience);  // until it has
  };
  if (preset == settings_.presets.end()) {
    reject(kNoSuchTitle);
    return "rejected";
  }
  if (const Callers& callers = preset->second.callers;
      !callers.may_be(calling) || !callers.may_come_from(served.address)) {
    tally.is_stranger = true;
    settings_.on_stranger(preset->second.name);
    reject(kNoSuchCaller);
    return "rejected: " + tally.calling + " at " + served.address.to_string() + " may not call";
  }
  channel.send({{"reject", kAccepted}});
  Arrivals arrivals(inbox_);
  while (const auto message = channel.receive(kIdlePatience)) {
    if (!message->is_document) {
      arrivals.take(message->content);
      continue;
    }
    const json said = document_of(*message);
    if (said.contains("released")) return "released";
    if (said.contains("alive")) continue;
    const std::uint16_t status = keep(arrivals, preset->second.name, said);
    ++(is_stored(status) ? tally.stored : tally.refused);
    channel.send({{"status", status}});
  }
  return "broken off";
}

std::uint16_t DimseListener::keep(Arrivals& arrivals, const std::string& preset, const json& announced) {
  const std::string sop_class = announced.at("sop_class"), sop_instance = announced.at("sop_instance");
  verifying_.acquire();
  const auto status = arrivals.keep(preset, sop_class, sop_instance);
  verifying_.release();
  return status;
}

}  // namespace volsmooth
