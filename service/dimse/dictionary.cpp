#include "service/dimse/dictionary.h"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>

#include <cstdlib>

namespace volsmooth {
namespace {

struct CommandElement {
  Uint16 number;
  DcmEVR vr;
};

constexpr CommandElement kCommandElements[] = {
    {0x0000, EVR_UL},  // group length
    {0x0002, EVR_UI},  // affected SOP class
    {0x0003, EVR_UI},  // requested SOP class
    {0x0100, EVR_US},  // command
    {0x0110, EVR_US},  // message id
    {0x0120, EVR_US},  // message id being responded to
    {0x0600, EVR_AE},  // move destination
    {0x0700, EVR_US},  // priority
    {0x0800, EVR_US},  // data set type
    {0x0900, EVR_US},  // status
    {0x0901, EVR_AT},  // offending element
    {0x0902, EVR_LO},  // error comment
    {0x0903, EVR_US},  // error id
    {0x1000, EVR_UI},  // affected SOP instance
    {0x1001, EVR_UI},  // requested SOP instance
    {0x1002, EVR_US},  // event type
    {0x1005, EVR_AT},  // attribute identifiers
    {0x1008, EVR_US},  // action type
    {0x1020, EVR_US},  // remaining, completed, failed and warning suboperations
    {0x1021, EVR_US}, {0x1022, EVR_US}, {0x1023, EVR_US}, {0x1030, EVR_AE},  // move originator
    {0x1031, EVR_US},                                                        // its message id
};

}  // namespace

void use_command_dictionary() {
  ::setenv("DCMDICTPATH", "/dev/null", 1);
  DcmDataDictionary& dictionary = dcmDataDict.wrlock();
  for (const auto& [number, vr] : kCommandElements)
    dictionary.addEntry(new DcmDictEntry(0x0000, number, vr, "", 1, DcmVariableVM, nullptr, false, nullptr));
  dcmDataDict.wrunlock();
}

}  // namespace volsmooth
