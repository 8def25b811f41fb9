#!/usr/bin/env bash
# Usage: tests/fuzz/make_corpus.sh BUILD. Writes tests/fuzz/corpus anew, of phantoms alone: what fuzz_seeds makes, and the
# slices of a series compressed by DCMTK and GDCM (libgdcm-tools). BUILD: a directory that the tests were configured in.
set -euo pipefail
cd "$(dirname "$0")"
corpus=$PWD/corpus
cmake --build "$1" --target fuzz_seeds
rm -rf "$corpus"
"$1/bin/fuzz_seeds" "$corpus"
slices=$corpus/dicom/slices

# multipart FILE...: a multipart body of them.
multipart() {
  local file
  for file; do
    printf -- '--part\r\nContent-Type: application/dicom\r\n\r\n'
    cat "$file"
    printf '\r\n'
  done
  printf -- '--part--\r\n'
}

# compressed NAME COMMAND...: the series with every slice put through the command, which takes two files.
compressed() {
  local name=$1 folder slice
  shift
  folder=$(mktemp -d)
  for slice in "$slices"/*; do "$@" "$slice" "$folder/${slice##*/}"; done
  multipart "$folder"/* >"$corpus/dicom/series_$name"
  rm -r "$folder"
}

compressed rle dcmcrle
compressed jpeg_lossless dcmcjpeg +e1
# A version of JFIF that there is not, of which GDCM's decoder asserts that it does not occur.
LC_ALL=C sed 's/JFIF\x00\x01/JFIF\x00\xfa/' "$corpus/dicom/series_jpeg_lossless" >"$corpus/dicom/series_jpeg_jfif_250"
compressed jpeg_ls dcmcjpls
compressed jpeg_2000 gdcmconv --j2k -n 1
rm -r "$slices"
