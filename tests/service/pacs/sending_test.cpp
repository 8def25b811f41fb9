#include "service/pacs/sending.h"

#include "service/pacs/instances.h"
#include "tests/service/pacs/silent_peer.h"
#include "tests/support/dicom_maker.h"
#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

const std::vector<std::string> kSent = {"1.1", "1.2", "1.3"};

std::string outcome(const NodeAnswer& answer) {
  std::string text;
  for (const InstanceAnswer& one : answers_from(answer, kSent))
    text += one.sop_instance_uid + (one.stored ? " stored" : " refused: " + one.reason) + "; ";
  return text;
}

TEST(Sending, EachInstanceGetsWhatTheNodeSaysOfIt) {
  const NodeAnswer answer{202, "application/dicom+json", R"({
    "00081199": {"vr": "SQ", "Value": [{"00081155": {"vr": "UI", "Value": ["1.1"]}}]},
    "00081198": {"vr": "SQ", "Value": [{"00081155": {"vr": "UI", "Value": ["1.2"]},
                                        "00081197": {"vr": "US", "Value": [42752]}}]}})"};
  EXPECT_EQ(outcome(answer),
            "1.1 stored; 1.2 refused: 0xA700; 1.3 refused: the node did not say that it has it; ");
}

TEST(Sending, StatusOkSaysThatAllAreStored) {
  EXPECT_EQ(outcome({200, "", "{}"}), "1.1 stored; 1.2 stored; 1.3 stored; ");
  EXPECT_EQ(outcome({200, "", "not JSON"}), "1.1 stored; 1.2 stored; 1.3 stored; ");
}

TEST(Sending, ARefusalStandsWhateverTheStatus) {
  EXPECT_EQ(outcome({200, "", R"({"00081198": {"Value": [{"00081155": {"Value": ["1.3"]}}]}})"}),
            "1.1 stored; 1.2 stored; 1.3 refused: no reason given; ");
}

TEST(Sending, AConflictWithoutAListStoresNothing) {
  for (const char* body : {"", "[]", R"({"00081199": 5})", R"({"00081199": {"Value": [{"00081155": {}}]}})"})
    EXPECT_EQ(outcome({409, "", body}).find("stored;"), std::string::npos) << body;
}

TEST(Sending, DoesNotWaitForASilentNodeWhenItIsToEnd) {
  const SilentPeer peer;
  const Node node{"silent", "http://127.0.0.1:" + std::to_string(peer.port())};
  const ScratchFolder folder;
  const auto file = folder.put("out.dcm", test::files_of(test::series_of({}))[0]);
  std::vector<DicomInstance> instances;
  for_each_instance(file, [&](const DicomInstance& instance, auto) { instances.push_back(instance); });
  ASSERT_EQ(instances.size(), 1U);
  expect_to_end_when_told([&](const auto& keep_going) {
    return send_instances(
        node, file, instances, [](const auto&) {}, keep_going);
  });
}

}  // namespace
}  // namespace volsmooth
