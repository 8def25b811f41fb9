#pragma once

#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

namespace volsmooth {

/// Where a figure's PNG and CSV go, and what it may use.
struct FigureOrder {
  std::filesystem::path directory;
  std::optional<std::filesystem::path> head;  ///< a NIfTI volume

  std::filesystem::path file(const std::string& name) const { return directory / name; }
};

void draw_figure_4_1(const FigureOrder& order);
void draw_figure_4_2(const FigureOrder& order);

}  // namespace volsmooth
