#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

namespace volsmooth {

/// Where a figure's PNG and CSV go, and what it may use.
struct FigureOrder {
  std::filesystem::path directory;
  std::optional<std::filesystem::path> head = std::nullopt;  ///< a NIfTI volume
  double isovalue = 0;                                       ///< of the bone in it
  bool coarse = false;                                       ///< for a look within seconds

  std::filesystem::path file(const std::string& name) const { return directory / name; }
  std::int64_t cells(std::int64_t when_fine, std::int64_t when_coarse) const {
    return coarse ? when_coarse : when_fine;
  }
};

void draw_figure_4_1(const FigureOrder& order);
void draw_figure_4_2(const FigureOrder& order);
void draw_figure_6_1(const FigureOrder& order);
void draw_figure_6_2(const FigureOrder& order);
void draw_figure_6_3(const FigureOrder& order);
void draw_figure_6_4(const FigureOrder& order);
void draw_figure_7_4(const FigureOrder& order);
void draw_figure_7_5(const FigureOrder& order);

}  // namespace volsmooth
