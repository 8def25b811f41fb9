#pragma once

#include "service/pacs/http_exchange.h"

namespace volsmooth {

/// Fetches a series by WADO-RS as a multipart body of Part 10 files, in the transfer syntax that the node
/// keeps them in, and checks against QIDO-RS that every instance came (DICOM PS3.18, 10.4 and 10.6).
tl::expected<void, NodeFailure> retrieve_series(const Node& node, const DicomSource& source,
                                                IncomingFile& file, std::int64_t max_bytes,
                                                const Progress& report);

}  // namespace volsmooth
