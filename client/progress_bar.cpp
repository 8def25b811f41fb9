#include "client/progress_bar.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "client/printable.h"

namespace volsmooth {
namespace {

constexpr int kBarWidth = 24;
constexpr double kMegabyte = 1e6;
constexpr std::chrono::milliseconds kDrawInterval{50};

std::string padded(std::string text, std::size_t width) {
  text.resize(std::max(text.size(), width), ' ');
  return text;
}

std::string duration(double seconds) {
  const auto whole = static_cast<long>(std::lround(std::clamp(seconds, 0.0, 359'999.0)));
  char text[24];
  if (whole < 3600) {
    std::snprintf(text, sizeof text, "%ld:%02ld", whole / 60, whole % 60);
  } else {
    std::snprintf(text, sizeof text, "%ld:%02ld:%02ld", whole / 3600, whole / 60 % 60, whole % 60);
  }
  return text;
}

int terminal_columns() {
  winsize size{};
  return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

}  // namespace

std::string bar_line(const ProgressView& view, int columns) {
  const double fraction = std::isfinite(view.fraction) ? std::clamp(view.fraction, 0.0, 1.0) : 0.0;
  const auto filled = static_cast<std::size_t>(fraction * kBarWidth);
  std::string line = padded(printable(view.stage), 9) + '[' + std::string(filled, '#') +
                     std::string(kBarWidth - filled, '-') + "] ";
  line += padded(std::to_string(static_cast<int>(fraction * 100)) + " %", 5);
  if (!view.amount.empty()) line += "  " + view.amount;
  if (view.eta_seconds) line += "  " + duration(*view.eta_seconds) + " left";
  line += "  " + printable(view.what);
  return line.substr(0, static_cast<std::size_t>(std::max(columns, 0)));
}

ProgressView view_of(const std::string& what, const nlohmann::json& job) {
  const nlohmann::json& progress = job.at("progress");
  ProgressView view{what, progress.at("stage").get<std::string>(), progress.at("fraction").get<double>()};
  if (const auto eta = progress.find("eta_seconds"); eta != progress.end() && eta->is_number()) {
    view.eta_seconds = eta->get<double>();
  }
  return view;
}

ProgressView view_of_transfer(const std::string& what, const std::string& stage, std::int64_t done,
                              std::int64_t all) {
  char amount[64];
  const double done_mb = static_cast<double>(done) / kMegabyte, all_mb = static_cast<double>(all) / kMegabyte;
  std::snprintf(amount, sizeof amount, "%.1f of %.1f MB", done_mb, all_mb);
  return {what, stage, all > 0 ? static_cast<double>(done) / static_cast<double>(all) : 1.0, amount};
}

ProgressBar::ProgressBar(bool wanted) : shown_(wanted && isatty(STDERR_FILENO) == 1) {}

void ProgressBar::show(const ProgressView& view) {
  const auto now = std::chrono::steady_clock::now();
  if (!shown_ || (view.stage == stage_ && now - drawn_ < kDrawInterval)) return;
  std::fprintf(stderr, "\r%s\x1b[K", bar_line(view, terminal_columns() - 1).c_str());
  stage_ = view.stage;
  drawn_ = now;
}

void ProgressBar::wipe() {
  if (!stage_.empty()) std::fputs("\r\x1b[K", stderr);
  stage_.clear();
}

}  // namespace volsmooth
