#pragma once

#include <atomic>
#include <list>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <semaphore>
#include <string>
#include <thread>

#include "service/jobs/pacs.h"
#include "service/jobs/refusal_rows.h"
#include "service/pacs/arrivals.h"
#include "service/pacs/callers.h"
#include "service/pacs/dimse_tls.h"
#include "service/pacs/listening_socket.h"
#include "service/pacs/turned_away.h"

namespace volsmooth {

/// A preset as devices see it.
struct CalledPreset {
  std::string name;
  Callers callers;
};

/// The presets by the AE titles that devices call them by. Throws std::runtime_error for one that has none,
/// and for two that have the same.
std::map<std::string, CalledPreset> presets_by_title(const std::vector<Preset>& presets);

/// Takes what devices send by C-STORE; the AE title that they call is the preset that runs on it. Each
/// association has a volsmooth-dimse of its own, so what a peer sends can end that association alone.
class DimseListener {
 public:
  struct Settings {
    std::string listen;  ///< ADDRESS:PORT
    bool allow_open_network = false;
    std::optional<DimseTls> tls = {};             ///< with it, by TLS alone, from peers with a certificate
    std::map<std::string, CalledPreset> presets;  ///< by AE title
    using Log = std::function<void(std::string_view event, const std::string& message)>;
    Log log, log_warning, log_error;
    /// One who may not call was turned away, by that preset or, empty, by all. From any thread.
    std::function<void(const std::string& preset)> on_stranger;
  };

  /// Listens at once. Throws std::runtime_error with a sentence that says what to change.
  DimseListener(Settings settings, Inbox inbox);
  ~DimseListener();  ///< ends all associations

  const std::string& address() const { return listening_.address; }

 private:
  struct Served;
  struct Tally;

  void accept_all(const std::stop_token& stopped);
  void begin(FileDescriptor connection, const boost::asio::ip::address_v4& address);
  void serve(Served& served);
  std::string talk(Served& served, Tally& tally);
  std::uint16_t keep(Arrivals& arrivals, const std::string& preset, const nlohmann::json& announced);

  /// Of associations that brought nothing, which anybody can cause, a part is logged.
  void log_fruitless(const Settings::Log& log, const std::string& line);

  const Settings settings_;
  const Inbox inbox_;
  ListeningSocket listening_;
  std::counting_semaphore<> verifying_;
  std::list<Served> served_;  // the accepting thread's, until that has ended
  TurnedAway turned_away_;    // its as well
  RefusalRows fruitless_;
  std::jthread accepting_;
};

}  // namespace volsmooth
