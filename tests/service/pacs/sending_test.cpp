#include "service/pacs/sending.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace volsmooth
