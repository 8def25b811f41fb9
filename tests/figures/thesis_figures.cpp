#include <algorithm>
#include <cstdio>
#include <string_view>
#include <vector>

#include "tests/figures/figures.h"

namespace volsmooth {
namespace {

struct Figure {
  std::string_view name, shows;
  void (*draw)(const FigureOrder&);
};

constexpr Figure kFigures[] = {
    {"4.1", "a 3-D vortex and back: piecewise constant against WENO", draw_figure_4_1},
    {"4.2", "a circle in a vortex: the level set method against the density", draw_figure_4_2},
    {"6.1", "a rabbit offset inwards and outwards", draw_figure_6_1},
    {"6.2", "a rabbit offset by functions of the height", draw_figure_6_2},
    {"6.3", "a circle that shrinks by its curvature: thesis, default, level set, exact", draw_figure_6_3},
    {"6.4", "mean curvature flow of a rabbit with and without its mass kept", draw_figure_6_4},
    {"7.4", "two surfaces of a head in one mean curvature flow (also Fig. 3.1)", draw_figure_7_4},
    {"7.5", "a skull, after mean curvature flow, after the heat equation", draw_figure_7_5},
};

constexpr const char* kHead = "/usr/share/mricron/templates/ch2.nii.gz";
constexpr double kIsovalueOfHead = 90;  // its white matter, and what is as bright

int usage() {
  std::puts(
      "thesis_figures DIRECTORY [--head VOLUME.nii.gz --isovalue BONE] [--coarse] [FIGURE...]\n\n"
      "Phantoms, and the head if there is one; without --head that of Debian's mricron-data.\n"
      "Figures (all, if none is named):");
  for (const auto& [name, shows, draw] : kFigures)
    std::printf("  %.*s  %.*s\n", static_cast<int>(name.size()), name.data(), static_cast<int>(shows.size()),
                shows.data());
  return 2;
}

int run(const std::vector<std::string>& arguments) {
  if (arguments.empty() || arguments[0].starts_with("-")) return usage();
  FigureOrder order{.directory = arguments[0]};
  if (std::filesystem::exists(kHead)) order.head = kHead;
  order.isovalue = kIsovalueOfHead;
  std::vector<std::string> names;
  for (std::size_t i = 1; i < arguments.size(); ++i) {
    if (arguments[i] == "--head" && i + 1 < arguments.size())
      order.head = arguments[++i];
    else if (arguments[i] == "--isovalue" && i + 1 < arguments.size())
      order.isovalue = std::stod(arguments[++i]);
    else if (arguments[i] == "--coarse")
      order.coarse = true;
    else
      names.push_back(arguments[i]);
  }
  const auto is_figure = [](const std::string& name) {
    return std::ranges::find(kFigures, name, &Figure::name) != std::end(kFigures);
  };
  if (!std::ranges::all_of(names, is_figure)) return usage();
  std::filesystem::create_directories(order.directory);
  for (const Figure& figure : kFigures)
    if (names.empty() || std::ranges::find(names, figure.name) != names.end()) figure.draw(order);
  return 0;
}

}  // namespace
}  // namespace volsmooth

int main(int count, char** arguments) {
  return volsmooth::run({arguments + 1, arguments + count});
}
