#include "service/http/openapi.h"
#include "service/http/problem_types.h"

namespace volsmooth {
namespace {

using nlohmann::json;

json list_of(std::string_view member, std::string_view schema) {
  return {{"type", "object"},
          {"required", {member}},
          {"properties", {{member, {{"type", "array"}, {"items", schema_reference(schema)}}}}}};
}

/// The documents whose form does not depend on what is on offer.
const json& fixed_schemas() {
  static const json schemas = json::parse(R"json({
    "Volume": {
      "type": "object",
      "required": ["id", "format", "size", "spacing_mm", "affine", "frame", "voxel_type", "intensity", "bytes", "sha256",
                   "warnings", "created_at", "expires_at"],
      "properties": {
        "id": {"type": "string"},
        "format": {"type": "string", "description": "Such as nifti-1."},
        "size": {"type": "array", "items": {"type": "integer", "minimum": 1}, "minItems": 3, "maxItems": 3},
        "spacing_mm": {"type": "array", "items": {"type": "number", "exclusiveMinimum": 0}, "minItems": 3, "maxItems": 3},
        "affine": {"description": "Voxel index to mm, row by row.", "type": "array", "minItems": 4, "maxItems": 4,
                   "items": {"type": "array", "items": {"type": "number"}, "minItems": 4, "maxItems": 4}},
        "frame": {"enum": ["RAS", "LPS"]},
        "voxel_type": {"type": "string", "description": "Such as int16."},
        "intensity": {"type": "object", "required": ["min", "max"],
                      "properties": {"min": {"type": "number"}, "max": {"type": "number"}}},
        "bytes": {"type": "integer", "minimum": 0},
        "sha256": {"type": "string", "pattern": "^[0-9a-f]{64}$"},
        "warnings": {"type": "array", "items": {"type": "string"}},
        "created_at": {"type": "string", "format": "date-time"},
        "expires_at": {"type": ["string", "null"], "format": "date-time"}}},
    "Parameters": {
      "type": "object",
      "description": "By the names that GET /v1/methods gives.",
      "additionalProperties": {"type": ["number", "string"]}},
    "Progress": {
      "type": "object",
      "required": ["stage", "fraction", "eta_seconds"],
      "properties": {
        "stage": {"type": "string"},
        "fraction": {"type": "number", "minimum": 0, "maximum": 1},
        "eta_seconds": {"type": ["number", "null"], "minimum": 0}}},
    "Result": {
      "type": "object",
      "required": ["name", "kind", "method", "isovalue", "frame", "media_type", "bytes", "sha256"],
      "properties": {
        "name": {"type": "string"},
        "kind": {"enum": ["volume", "surface", "report", "picture", "series", "dicom"]},
        "method": {"type": ["string", "null"]},
        "isovalue": {"type": ["number", "array", "null"], "items": {"type": "number"}},
        "frame": {"enum": ["RAS", "LPS", null]},
        "media_type": {"type": "string"},
        "bytes": {"type": "integer", "minimum": 0},
        "sha256": {"type": "string", "pattern": "^[0-9a-f]{64}$"}}},
    "Job": {
      "type": "object",
      "required": ["id", "state", "method", "parameters", "progress", "label", "created_at", "started_at", "finished_at",
                   "error", "results"],
      "properties": {
        "id": {"type": "string"},
        "state": {"enum": ["queued", "running", "succeeded", "failed", "cancelled"]},
        "method": {"type": "string"},
        "parameters": {"$ref": "#/components/schemas/Parameters"},
        "order": {"$ref": "#/components/schemas/JobOrder"},
        "progress": {"$ref": "#/components/schemas/Progress"},
        "label": {"type": ["string", "null"]},
        "created_at": {"type": "string", "format": "date-time"},
        "started_at": {"type": ["string", "null"], "format": "date-time"},
        "finished_at": {"type": ["string", "null"], "format": "date-time"},
        "expires_at": {"description": "When it goes with its results; null until its end, or for ever.",
                       "type": ["string", "null"], "format": "date-time"},
        "error": {"anyOf": [{"$ref": "#/components/schemas/Problem"}, {"type": "null"}]},
        "next_attempt_at": {"description": "When a source that could not give the series is asked again.",
                            "type": ["string", "null"], "format": "date-time"},
        "results": {"type": "array", "items": {"$ref": "#/components/schemas/Result"}},
        "delivery": {"anyOf": [{"$ref": "#/components/schemas/Delivery"}, {"type": "null"}]}}},
    "AcceptedJob": {
      "description": "The job; of one who may submit but not read, its id and state alone.",
      "anyOf": [{"$ref": "#/components/schemas/Job"},
                {"type": "object", "required": ["id", "state"], "additionalProperties": false,
                 "properties": {"id": {"type": "string"},
                                "state": {"enum": ["queued", "running", "succeeded", "failed", "cancelled"]}}}]},
    "Delivery": {
      "description": "How far the DICOM outputs are on their way to the job's destination.",
      "type": "object",
      "required": ["destination", "state", "instances", "stored", "refused", "tries", "next_attempt_at", "error"],
      "properties": {
        "destination": {"type": "string"},
        "state": {"enum": ["pending", "delivered", "failed"]},
        "instances": {"type": "integer", "minimum": 0},
        "stored": {"type": "integer", "minimum": 0},
        "refused": {"type": "integer", "minimum": 0},
        "tries": {"description": "Those that did not come to an end.", "type": "integer", "minimum": 0},
        "next_attempt_at": {"type": ["string", "null"], "format": "date-time"},
        "error": {"anyOf": [{"$ref": "#/components/schemas/Problem"}, {"type": "null"}]}}},
    "Ledger": {
      "type": "object",
      "required": ["instances"],
      "properties": {
        "instances": {"type": "array", "items": {
          "type": "object",
          "required": ["sop_class_uid", "sop_instance_uid", "result", "state", "reason"],
          "properties": {
            "sop_class_uid": {"type": "string"},
            "sop_instance_uid": {"type": "string"},
            "result": {"type": "string"},
            "state": {"enum": ["pending", "stored", "refused"]},
            "reason": {"type": ["string", "null"]}}}}}},
    "VolumePage": {
      "type": "object",
      "required": ["volumes", "next_cursor"],
      "properties": {
        "volumes": {"type": "array", "items": {"$ref": "#/components/schemas/Volume"}},
        "next_cursor": {"type": ["string", "null"]}}},
    "JobPage": {
      "type": "object",
      "required": ["jobs", "next_cursor"],
      "properties": {
        "jobs": {"type": "array", "items": {"$ref": "#/components/schemas/Job"}},
        "next_cursor": {"type": ["string", "null"]}}},
    "Method": {
      "type": "object",
      "required": ["name", "description", "parameters"],
      "properties": {
        "name": {"type": "string"},
        "description": {"type": "string"},
        "parameters": {"type": "array", "items": {"$ref": "#/components/schemas/MethodParameter"}},
        "parts": {"description": "The methods that it runs side by side.", "type": "array", "items": {"type": "string"}},
        "memory": {"description": "What a job takes at its peak, for volumes of up to 256^3 voxels; of larger ones the surfaces grow with the area only. A job is refused when that is more than the service lets one take.",
          "type": "object", "required": ["fixed_bytes", "bytes_per_voxel", "bytes_per_voxel_and_isovalue"],
          "properties": {"fixed_bytes": {"type": "integer"}, "bytes_per_voxel": {"type": "number"},
                         "bytes_per_voxel_and_isovalue": {"type": "number"}}}}},
    "MethodParameter": {
      "type": "object",
      "required": ["name", "description", "type", "unit", "default"],
      "properties": {
        "name": {"type": "string"},
        "description": {"type": "string"},
        "type": {"enum": ["number", "string"]},
        "unit": {"type": ["string", "null"]},
        "minimum": {"description": "Without limits: within the volume's intensities.", "type": "number"},
        "maximum": {"type": "number"},
        "choices": {"type": "array", "items": {"type": "string"}},
        "default": {"type": ["number", "string", "null"]},
        "default_text": {"description": "How the default follows from the volume.", "type": "string"},
        "excludes": {"description": "The parameter that may not be given beside this one.", "type": "string"},
        "needs": {"description": "The parameter without which this one says nothing.", "type": "string"},
        "required": {"description": "True where there is no default.", "type": "boolean"}}},
    "Format": {
      "type": "object",
      "required": ["name", "media_type", "description"],
      "properties": {
        "name": {"type": "string"}, "media_type": {"type": "string"}, "description": {"type": "string"}}},
    "FormatList": {
      "type": "object",
      "required": ["inputs", "outputs", "meshes"],
      "properties": {
        "inputs": {"type": "array", "items": {"$ref": "#/components/schemas/Format"}},
        "outputs": {"type": "array", "items": {"$ref": "#/components/schemas/Format"}},
        "meshes": {"type": "array", "items": {"$ref": "#/components/schemas/Format"}}}},
    "Status": {"type": "object", "required": ["status"], "properties": {"status": {"type": "string"}}}
  })json");
  return schemas;
}

json order_schema(const std::vector<MethodInfo>& methods) {
  json names = json::array();
  for (const auto& method : methods) names.push_back(method.name);
  json order = json::parse(R"json({
    "type": "object",
    "anyOf": [{"required": ["volume"]}, {"required": ["source"]}],
    "additionalProperties": false,
    "properties": {
      "volume": {"type": "string", "description": "The id of an uploaded volume."},
      "source": {"type": "object", "description": "A series that is fetched from a node of the configuration.",
                 "required": ["dicomweb", "study", "series"], "additionalProperties": false,
                 "properties": {"dicomweb": {"type": "string", "description": "The node's name; it must be there for the caller's tenant."},
                                "study": {"type": "string"}, "series": {"type": "string"}}},
      "destination": {"type": "string", "description": "The node of the configuration that gets the DICOM outputs; it must be there for the caller's tenant."},
      "method": {"default": "mean-curvature-flow"},
      "parameters": {"$ref": "#/components/schemas/Parameters"},
      "isovalues": {"default": "auto", "anyOf": [{"const": "auto"}, {"type": "array", "items": {"type": "number"}}]},
      "mesh_formats": {"type": "array", "items": {"enum": ["stl", "ply", "obj", "glb"]}, "default": ["stl"]},
      "mesh_frame": {"enum": ["RAS", "LPS"], "description": "Default: the volume's own."},
      "voxel_type": {"enum": ["same", "float32"], "default": "same"},
      "outputs": {"type": "array", "default": ["nifti"],
        "description": "All but nifti need a DICOM input.",
        "items": {"enum": ["nifti", "dicom-series", "dicom-stl", "dicom-obj", "dicom-surface-segmentation"]}},
      "priority": {"type": "integer", "minimum": -60, "maximum": 60, "default": 0,
                   "description": "Each step is worth a minute of waiting beside the other jobs of the same tenant."},
      "keep_days": {"type": "integer", "minimum": 0, "maximum": 36500,
                    "description": "Days after its end that the job and its results are kept, up to what the service is set to, which is the default. 0: for ever, where the service is set to that."},
      "label": {"type": "string", "description": "Free text of yours."}}
  })json");
  order["properties"]["method"]["enum"] = names;
  return order;
}

json problem_schema() {
  json types = json::array();
  for (const auto& type : problem_types()) types.push_back("/problems/" + std::string(type.slug));
  return {{"type", "object"},
          {"description", "RFC 9457; some problems have members of their own."},
          {"required", {"type", "title", "status", "detail"}},
          {"properties",
           {{"type", {{"enum", types}}},
            {"title", {{"type", "string"}}},
            {"status", {{"type", "integer"}}},
            {"detail", {{"type", "string"}}}}}};
}

}  // namespace

json document_schemas(const std::vector<MethodInfo>& methods) {
  json schemas = fixed_schemas();
  schemas["JobOrder"] = order_schema(methods);
  schemas["Problem"] = problem_schema();
  schemas["ResultList"] = list_of("results", "Result");
  schemas["MethodList"] = list_of("methods", "Method");
  return schemas;
}

}  // namespace volsmooth
