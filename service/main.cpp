// The composition root: the only file that knows everyone.

#include <malloc.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>

#include "service/audit_commands.h"
#include "service/backup_commands.h"
#include "service/commands.h"
#include "service/configuration.h"
#include "service/control/control_socket.h"
#include "service/http/log.h"
#include "service/http/metrics.h"
#include "service/http/server.h"
#include "service/jobs/job_service.h"
#include "service/jobs/machine.h"
#include "service/jobs/refusal_rows.h"
#include "service/jobs/tokens.h"
#include "service/pacs/dimse_listener.h"
#include "service/pacs/pacs.h"
#include "service/pacs/presets.h"
#include "service/pipeline/ingest_child.h"
#include "service/pipeline/pipeline.h"
#include "service/stage_times.h"

namespace volsmooth {
namespace {

constexpr int kUsageError = 2;

struct Options {
  ServerSettings server;
  JobServiceSettings jobs;
  std::filesystem::path ingest_program;
  std::string dimse_listen;
  DimseTls dimse_tls;
  std::string log_level = "info";
  bool ephemeral = false;
  bool print_configuration = false;
  bool allow_open_dimse = false;
  int keep_days = 7;
  int scrub_days = 7;
  bool require_tokens = false;
  // Of the configuration file.
  std::vector<Node> nodes;
  std::vector<Preset> presets;
};

void declare(CLI::App& app, Options& options) {
  app.set_version_flag("--version", "volsmoothd " VOLSMOOTH_VERSION);
  app.set_config("--config", "", "Reads options and DICOM nodes from this file (JSON)")
      ->envname("VOLSMOOTH_CONFIG");
  app.allow_config_extras(CLI::config_extras_mode::error);
  app.add_option("--listen", options.server.listen, "ADDRESS:PORT (port 0: any free one) or unix:PATH")
      ->envname("VOLSMOOTH_LISTEN")
      ->capture_default_str();
  auto* const dimse_listen = app.add_option("--dimse-listen", options.dimse_listen,
                                            "ADDRESS:PORT where devices send to the presets by C-STORE (port "
                                            "0: any free one); default: nowhere")
                                 ->envname("VOLSMOOTH_DIMSE_LISTEN");
  auto* const dimse_cert =
      app.add_option(
             "--dimse-tls-cert", options.dimse_tls.cert_file,
             "Certificate chain (PEM) to take devices by TLS alone, each with a certificate of its own; "
             "read for every association, as are the other two")
          ->envname("VOLSMOOTH_DIMSE_TLS_CERT");
  auto* const dimse_key =
      app.add_option("--dimse-tls-key", options.dimse_tls.key_file, "Its private key (PEM)")
          ->envname("VOLSMOOTH_DIMSE_TLS_KEY");
  auto* const dimse_ca = app.add_option("--dimse-tls-ca", options.dimse_tls.ca_file,
                                        "Certificates (PEM) that vouch for those of the devices")
                             ->envname("VOLSMOOTH_DIMSE_TLS_CA");
  dimse_cert->needs(dimse_key, dimse_ca, dimse_listen);
  dimse_key->needs(dimse_cert);
  dimse_ca->needs(dimse_cert);
  app.add_option("--data", options.jobs.data_dir,
                 "Folder of the volumes, jobs and results; made when missing")
      ->envname("VOLSMOOTH_DATA")
      ->required();
  app.add_option("--threads", options.jobs.threads,
                 "Compute threads of a job; 0: all cores that the daemon may use")
      ->envname("VOLSMOOTH_THREADS")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  app.add_option("--workers", options.jobs.workers,
                 "Jobs that run at the same time; of several, one place is kept for jobs of seconds")
      ->envname("VOLSMOOTH_WORKERS")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  app.add_option(
         "--memory", options.jobs.memory_limit_bytes,
         "Memory of all running jobs, such as 8GB; 0: 80 % of the machine's or, in a container, of its limit")
      ->envname("VOLSMOOTH_MEMORY")
      ->transform(CLI::AsSizeValue(false))
      ->capture_default_str();
  app.add_option("--max-upload", options.jobs.max_upload_bytes, "Largest upload, such as 16GB")
      ->envname("VOLSMOOTH_MAX_UPLOAD")
      ->transform(CLI::AsSizeValue(false))
      ->capture_default_str();
  app.add_option(
         "--keep-days", options.keep_days,
         "Days that volumes are kept after their upload, jobs and results after the job's end; 0: for ever")
      ->envname("VOLSMOOTH_KEEP_DAYS")
      ->check(CLI::Range(0, 36500))
      ->capture_default_str();
  app.add_option("--scrub-days", options.scrub_days,
                 "Every stored file is read and checked once in so many days; 0: only when it is asked for")
      ->envname("VOLSMOOTH_SCRUB_DAYS")
      ->check(CLI::Range(0, 3650))
      ->capture_default_str();
  app.add_option(
         "--tenant-storage", options.jobs.tenant_max_bytes,
         "Volumes and results that are kept for one tenant, such as 500GB; 0: as much as the disk holds")
      ->envname("VOLSMOOTH_TENANT_STORAGE")
      ->transform(CLI::AsSizeValue(false))
      ->capture_default_str();
  app.add_option("--tenant-queue", options.jobs.tenant_max_queued, "Jobs of one tenant that may wait")
      ->envname("VOLSMOOTH_TENANT_QUEUE")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  app.add_option("--queue", options.jobs.max_queued, "Jobs of all tenants that may wait")
      ->envname("VOLSMOOTH_QUEUE")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  app.add_option("--ingest", options.ingest_program,
                 "volsmooth-ingest, which reads DICOM; default: beside this program")
      ->envname("VOLSMOOTH_INGEST");
  app.add_option("--log-level", options.log_level, "What is logged at least")
      ->envname("VOLSMOOTH_LOG_LEVEL")
      ->check(CLI::IsMember({"debug", "info", "warn", "error", "off"}))
      ->capture_default_str();
  app.add_option("--host-name", options.server.host_names,
                 "A name by which clients address this daemon, beside localhost; repeatable")
      ->envname("VOLSMOOTH_HOST_NAME");
  app.add_flag("--allow-open-dimse", options.allow_open_dimse,
               "Allows --dimse-listen on addresses that others than this machine reach; of DIMSE, only "
               "the presets' 'from' is access control")
      ->envname("VOLSMOOTH_ALLOW_OPEN_DIMSE");
  app.add_flag("--allow-open-network", options.server.allow_open_network,
               "Allows to listen on addresses that others than this machine reach, without TLS or tokens")
      ->envname("VOLSMOOTH_ALLOW_OPEN_NETWORK");
  app.add_option("--tls-cert", options.server.tls_certificate,
                 "Certificate chain (PEM) to listen by TLS; read again on SIGHUP, as is the key")
      ->envname("VOLSMOOTH_TLS_CERT");
  app.add_option("--tls-key", options.server.tls_key, "Its private key (PEM)")->envname("VOLSMOOTH_TLS_KEY");
  app.add_flag("--require-tokens", options.require_tokens,
               "Callers need a token even before there is one (volsmoothd token create)")
      ->envname("VOLSMOOTH_REQUIRE_TOKENS");
  app.add_flag("--print-config", options.print_configuration,
               "Prints the configuration that is in force, as a configuration file would say it, and ends");
  app.add_flag("--ephemeral", options.ephemeral,
               "Removes the data folder at the end; it must be new or empty")
      ->envname("VOLSMOOTH_EPHEMERAL");
}

/// A folder that is removed at the end, unless it held something before.
class EphemeralFolder {
 public:
  explicit EphemeralFolder(std::filesystem::path path) : path_(std::move(path)) {
    if (std::filesystem::exists(path_) && !std::filesystem::is_empty(path_))
      throw std::runtime_error(
          "--ephemeral would remove what is in the data folder; give one that is new or empty");
  }
  ~EphemeralFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  EphemeralFolder(const EphemeralFolder&) = delete;
  EphemeralFolder& operator=(const EphemeralFolder&) = delete;

 private:
  std::filesystem::path path_;
};

/// Each may hold a file beside its socket; the rest is for the database, the jobs and the libraries.
int connections_for(std::int64_t open_files) {
  constexpr std::int64_t kOther = 128;
  return static_cast<int>(std::max<std::int64_t>((open_files - kOther) / 2, 1));
}

/// What an answer of 100 KB takes is not given back to the system only to be asked for again by the next one:
/// that was a fifth of the time of a page of jobs. Volumes are given back at once.
void keep_memory_of_answers() {
  ::mallopt(M_MMAP_THRESHOLD, 4 << 20);
  ::mallopt(M_TRIM_THRESHOLD, 8 << 20);
}

/// SIGHUP only where it has a meaning: under nohup it is to be ignored, and a signal that is waited for is
/// not.
sigset_t awaited_signals(bool has_certificate) {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGTERM);
  sigaddset(&set, SIGINT);
  struct sigaction hang_up {};
  ::sigaction(SIGHUP, nullptr, &hang_up);
  if (has_certificate || hang_up.sa_handler != SIG_IGN) sigaddset(&set, SIGHUP);
  return set;
}

void reload_tls(Server& server) {
  try {
    server.reload_tls();
    log_event("tls-reloaded", "new connections get the certificate that is there now");
  } catch (const std::runtime_error& error) {
    log_error("tls-not-reloaded", error.what());
  }
}

/// Counts and audits devices that may not call; of the rows a part, like those of unknown callers by HTTP.
std::function<void(const std::string&)> turned_away_devices(JobService& jobs, Metrics& metrics) {
  return [&jobs, &metrics, rows = std::make_shared<RefusalRows>()](const std::string& preset) {
    metrics.association_refused();
    const auto others = rows->admit();
    if (!others) return;
    try {
      jobs.audit_done({"association refused", preset, "caller-not-allowed" + *others});
    } catch (const std::exception& error) {  // the refusal stands
      log_error("dimse-fault", error.what());
    }
  };
}

/// Devices speak DIMSE with it; what comes is kept by the jobs.
void listen_for_devices(const Options& options, JobService& jobs, Metrics& metrics,
                        std::optional<DimseListener>& listener) {
  if (options.dimse_listen.empty()) return;
  Inbox inbox;
  inbox.begin = [&jobs] { return jobs.begin_arrival(); };
  inbox.keep = [&jobs, &options](const std::string& name, IncomingFile file) {
    const auto preset = std::ranges::find(options.presets, name, &Preset::name);
    const Caller device{preset->tenant, "", {Scope::kSubmit}};
    return jobs.receive(device, name, std::move(file));
  };
  inbox.max_bytes = options.jobs.max_upload_bytes;
  const auto tls = options.dimse_tls.cert_file.empty() ? std::nullopt : std::optional(options.dimse_tls);
  listener.emplace(DimseListener::Settings{options.dimse_listen, options.allow_open_dimse, tls,
                                           presets_by_title(options.presets), log_event, log_warning,
                                           log_error, turned_away_devices(jobs, metrics)},
                   std::move(inbox));
  log_event("dimse-ready", std::string("listening for DICOM associations ") + (tls ? "by TLS " : "") + "on " +
                               listener->address());
}

/// Some file systems, such as folders shared into a virtual machine, have no sockets; serving goes on
/// without.
void listen_for_commands(const Options& options, JobService& jobs, std::optional<ControlSocket>& control) {
  try {
    control.emplace(options.jobs.data_dir, [&jobs](const std::string& request, uid_t user) {
      return answer_command(jobs, request, user);
    });
  } catch (const std::runtime_error& error) {
    log_warning("no-commands", error.what());
  }
}

/// Without it every DICOM upload would fail, by no fault of its own.
void require_ingest(const std::filesystem::path& given) {
  const auto program = given.empty() ? ingest_beside_this_program() : given;
  if (::access(program.c_str(), X_OK) != 0)
    throw std::runtime_error("volsmooth-ingest, which reads DICOM, cannot be run: " + program.string() +
                             (given.empty() ? " is missing; --ingest names it elsewhere" : " (--ingest)"));
}

void serve(const Options& options) {
  require_ingest(options.ingest_program);
  std::optional<EphemeralFolder> folder;
  if (options.ephemeral) folder.emplace(options.jobs.data_dir);

  Metrics metrics;
  std::atomic<bool> store_lost = false;
  JobService jobs(options.jobs,
                  with_stage_times(make_engine({.max_memory_bytes = options.jobs.memory_limit_bytes,
                                                .ingest_program = options.ingest_program}),
                                   [&metrics](std::string_view stage, double seconds) {
                                     metrics.stage_done(stage, seconds);
                                   }),
                  make_pacs(options.nodes, options.presets, options.jobs.max_upload_bytes));
  jobs.on_final([&metrics](const Job& job) {
    metrics.job_done(job);
    log_job(job);
  });
  jobs.on_store_lost([&store_lost] {
    store_lost = true;
    ::kill(::getpid(), SIGTERM);
  });
  if (options.require_tokens) jobs.tokens().require();
  Server server(options.server, {jobs, metrics});
  std::optional<ControlSocket> control;
  listen_for_commands(options, jobs, control);
  std::optional<DimseListener> listener;
  listen_for_devices(options, jobs, metrics, listener);
  jobs.start();
  log_event("ready", "volsmoothd " VOLSMOOTH_VERSION " listening on " + server.address());

  const sigset_t signals = awaited_signals(!options.server.tls_certificate.empty());
  int received = 0;
  // Without TLS there is nothing to read again: it stops, like any program whose terminal goes.
  while (sigwait(&signals, &received) == 0 && received == SIGHUP && !options.server.tls_certificate.empty())
    reload_tls(server);
  log_event("stopping", std::string("SIG") + ::sigabbrev_np(received));
  jobs.stop();  // first: those whose uploads are being verified still get an answer
  listener.reset();
  control.reset();
  server.stop();
  if (store_lost) throw std::runtime_error(jobs.not_ready_because().value_or("the store was lost"));
}

/// The exit code of what is done instead of serving.
int guarded(const std::function<int()>& command) {
  try {
    const int code = command();
    if (!std::cout.flush()) throw std::runtime_error("standard output cannot be written to");
    return code;
  } catch (const std::exception& error) {
    std::cerr << "volsmoothd: " << error.what() << '\n';
    return 1;
  }
}

int run(int argc, char** argv) {
  Options options;
  CLI::App app("Smooths medical volumes; an HTTP service. GET /openapi.json describes it.", "volsmoothd");
  declare(app, options);
  const AuditCommands audit(app);
  const BackupCommands backup(app);
  const Commands commands(app);
  const auto configuration = std::make_shared<JsonConfiguration>(app);
  app.config_formatter(configuration);
  try {
    read_environment_files(app);
    app.parse(argc, argv);
    options.nodes = nodes_from(configuration->nodes());
    options.presets = presets_from(configuration->presets());
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kUsageError;
  } catch (const std::runtime_error& error) {
    std::cerr << "volsmoothd: " << error.what() << '\n';
    return kUsageError;
  }
  if (options.print_configuration)
    return guarded([&] {
      std::cout << configuration->to_config(&app, true, false, {}) << '\n';
      return 0;
    });
  if (backup.asked()) return guarded([&] { return backup.run(options.jobs.data_dir); });
  if (audit.asked()) return guarded([&] { return audit.run(options.jobs.data_dir); });
  if (commands.asked()) return guarded([&] { return commands.run(options.jobs.data_dir); });
  options.server.max_upload_bytes = options.jobs.max_upload_bytes;
  options.jobs.keep = std::chrono::days(options.keep_days);
  options.jobs.scrub_period = std::chrono::days(options.scrub_days);
  // The memory is said once, for the single job as for all that run together.
  options.jobs = completed(std::move(options.jobs));
  options.server.max_connections =
      std::min(options.server.max_connections, connections_for(raise_open_files()));

  keep_memory_of_answers();
  // Before any thread is there: all inherit the mask, and only sigwait takes them.
  const sigset_t signals = awaited_signals(!options.server.tls_certificate.empty());
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  ::signal(SIGPIPE, SIG_IGN);
  start_log(options.log_level);
  for (const std::string& variable : unknown_variables(app))
    log_warning("unknown-variable", "nothing here goes by the environment's " + variable);
  try {
    serve(options);
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "volsmoothd: " << error.what() << '\n';
    return 1;
  }
}

}  // namespace
}  // namespace volsmooth

int main(int argc, char** argv) {
  ::umask(077);  // patient data is its owner's, also in a folder that was there before
  return volsmooth::run(argc, argv);
}
