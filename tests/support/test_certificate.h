#pragma once

#include <openssl/pem.h>
#include <openssl/x509.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>

namespace volsmooth {

/// A self-signed certificate and its key, in PEM files.
struct TestCertificate {
  std::filesystem::path certificate, key;

  /// `name`: its common name, and that of the files. `password`: of the key; empty: none is needed.
  static TestCertificate make(const std::filesystem::path& folder, const std::string& name,
                              const std::string& password = "") {
    const TestCertificate made{folder / (name + ".crt"), folder / (name + ".key")};
    const std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> key(EVP_EC_gen("P-256"), &EVP_PKEY_free);
    const std::unique_ptr<X509, decltype(&X509_free)> certificate(X509_new(), &X509_free);
    X509_set_version(certificate.get(), 2);
    ASN1_INTEGER_set(X509_get_serialNumber(certificate.get()), 1);
    X509_gmtime_adj(X509_getm_notBefore(certificate.get()), -60);
    X509_gmtime_adj(X509_getm_notAfter(certificate.get()), 3600);
    X509_set_pubkey(certificate.get(), key.get());
    X509_NAME* const subject = X509_get_subject_name(certificate.get());
    X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_ASC,
                               reinterpret_cast<const unsigned char*>(name.c_str()), -1, -1, 0);
    X509_set_issuer_name(certificate.get(), subject);
    X509_sign(certificate.get(), key.get(), EVP_sha256());
    const auto write = [](const std::filesystem::path& file, const auto& put) {
      const std::unique_ptr<FILE, int (*)(FILE*)> out(std::fopen(file.c_str(), "w"), &std::fclose);
      if (!out || put(out.get()) != 1) throw std::runtime_error("cannot write " + file.string());
    };
    write(made.certificate, [&](FILE* out) { return PEM_write_X509(out, certificate.get()); });
    write(made.key, [&](FILE* out) {
      return PEM_write_PrivateKey(out, key.get(), password.empty() ? nullptr : EVP_aes_128_cbc(),
                                  reinterpret_cast<const unsigned char*>(password.data()),
                                  static_cast<int>(password.size()), nullptr, nullptr);
    });
    return made;
  }
};

}  // namespace volsmooth
