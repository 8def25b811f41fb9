#include "service/http/file_reply.h"

#include "service/http/accept.h"
#include "service/http/entity_tag.h"
#include "service/http/range.h"

namespace volsmooth {
namespace {

constexpr std::string_view kBoundary = "volsmooth-ranges-3f1c8a52e07b4d96";

std::string content_range(const ByteRange& range, std::int64_t size) {
  return "bytes " + std::to_string(range.first) + "-" + std::to_string(range.first + range.length - 1) + "/" +
         std::to_string(size);
}

std::vector<FilePiece> multipart_pieces(const std::vector<ByteRange>& ranges, const StoredFile& file) {
  std::vector<FilePiece> pieces;
  for (const auto& range : ranges) {
    const std::string head = "\r\n--" + std::string(kBoundary) + "\r\nContent-Type: " + file.media_type +
                             "\r\nContent-Range: " + content_range(range, file.bytes) + "\r\n\r\n";
    pieces.push_back({head, range.first, range.length});
  }
  pieces.push_back({"\r\n--" + std::string(kBoundary) + "--\r\n", 0, 0});
  return pieces;
}

/// Whether what is sent first is what was stored. What comes later is checked when it is its turn; by then,
/// all that can be done is to end the connection.
bool begins_whole(const FileBody& body) {
  try {
    for (const FilePiece& piece : body.pieces)
      if (piece.length > 0) body.file->check(piece.offset);
    return true;
  } catch (const DamagedFile&) {
    return false;
  }
}

}  // namespace

Reply reply_with_file(const Request& request, const StoredFile& file) {
  if (!accepts(request.head.list("accept"), file.media_type))
    return tl::unexpected(Problem{"not-acceptable", "It can only be sent as " + file.media_type + "."});
  const std::string tag = '"' + file.sha256 + '"';
  Response response{200, {{"ETag", tag}, {"Accept-Ranges", "bytes"}, {"Cache-Control", "no-store"}}};
  if (if_none_match_names(request.head, tag)) {
    response.status = 304;
    return response;
  }

  const auto if_range = request.head.header("if-range");
  std::vector<ByteRange> ranges;
  if (request.head.method == "GET" && (if_range.empty() || if_range == tag)) {
    auto asked = parse_range(request.head.header("range"), file.bytes);
    if (!asked) return tl::unexpected(asked.error());
    ranges = std::move(*asked);
  }

  FileBody body{file.file, {{"", 0, file.bytes}}, file.media_type};
  if (!ranges.empty()) response.status = 206;
  if (ranges.size() == 1) {
    response.headers.push_back({"Content-Range", content_range(ranges[0], file.bytes)});
    body.pieces = {{"", ranges[0].first, ranges[0].length}};
  } else if (ranges.size() > 1) {
    body.media_type = "multipart/byteranges; boundary=" + std::string(kBoundary);
    body.pieces = multipart_pieces(ranges, file);
  }
  if (!begins_whole(body))
    return tl::unexpected(Problem{"integrity-failure", "The stored file is damaged and is not given out."});
  response.body = std::move(body);
  return response;
}

}  // namespace volsmooth
