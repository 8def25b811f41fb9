#pragma once

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmnet/assoc.h>
#include <dcmtk/dcmnet/dimse.h>

#include <stdexcept>

namespace volsmooth {

constexpr int kAssociationSeconds = 30;  ///< for its negotiation and its release

/// DCMTK's network, which it wants to be made first and dropped last.
class Network {
 public:
  explicit Network(T_ASC_NetworkRole role) {
    if (ASC_initializeNetwork(role, 0, kAssociationSeconds, &network_).bad())
      throw std::runtime_error("DCMTK's network cannot be made");
  }
  Network(const Network&) = delete;
  ~Network() { ASC_dropNetwork(&network_); }
  T_ASC_Network* get() const { return network_; }

 private:
  T_ASC_Network* network_ = nullptr;
};

/// An association that is released when it goes, or aborted.
class Association {
 public:
  Association() = default;
  Association(const Association&) = delete;
  ~Association() {
    if (!association_) return;
    if (is_open_) ASC_abortAssociation(association_);
    ASC_destroyAssociation(&association_);
  }

  T_ASC_Association* get() const { return association_; }
  T_ASC_Association** into() { return &association_; }
  T_ASC_Parameters* parameters() const { return association_->params; }
  void opened() { is_open_ = true; }
  void ended() { is_open_ = false; }

 private:
  T_ASC_Association* association_ = nullptr;
  bool is_open_ = false;
};

}  // namespace volsmooth
