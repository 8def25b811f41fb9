#include "service/ingest/commands.h"

#include <array>

namespace volsmooth {
namespace {

constexpr std::array kCommands{
    IngestCommand{"instances", answer_instances}, IngestCommand{"inspect", answer_inspect},
    IngestCommand{"decode", answer_decode}, IngestCommand{"derive", answer_derive}};

}  // namespace

std::span<const IngestCommand> ingest_commands() {
  return kCommands;
}

}  // namespace volsmooth
