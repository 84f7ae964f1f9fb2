#!/usr/bin/env bash
# Builds absl, gRPC and TBB with the thread sanitizer: instrumented.sh FOLDER. Debian's have no instrumentation, so that
# neither their locks nor their atomics are seen. The sources are Debian's own packages of the installed versions, so that the
# libraries in FOLDER/lib take the place of the installed ones. Half an hour on two cores, once.
set -euo pipefail
folder="${1:?a folder}"
mkdir -p "$folder/apt/parts" "$folder/apt/lists/partial"
folder="$(cd "$folder" && pwd)"
readonly folder
readonly flags="-O1 -g1 -DNDEBUG -fsanitize=thread" libraries=/usr/lib/x86_64-linux-gnu
[[ ! -e "$folder/lib/done" ]] || exit 0
cd "$folder"

cat >apt/parts/sources.sources <<END
Types: deb-src
URIs: http://deb.debian.org/debian
Suites: bookworm bookworm-updates
Components: main
Signed-By: /usr/share/keyrings/debian-archive-keyring.gpg
END
apt=(apt-get -qq -o Dir::Etc::sourcelist=/dev/null -o "Dir::Etc::sourceparts=$folder/apt/parts" -o "Dir::State::lists=$folder/apt/lists")
"${apt[@]}" update
"${apt[@]}" source abseil grpc onetbb

build() {
  local -r source="$1" target="$2"
  shift 2
  cmake -G Ninja -S "$source" -B "build-$target" -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_CXX_STANDARD=17 -DBUILD_SHARED_LIBS=ON \
    -DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache \
    -DCMAKE_C_FLAGS_RELWITHDEBINFO="$flags" -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="$flags" "$@" >"$target.log"
  nice ninja -C "build-$target" "$target" >>"$target.log"
}
build abseil-*/ all
# The library of protobuf's compiler is asked for by plugins that are not built.
build grpc-*/ grpc++ -DgRPC_BUILD_TESTS=OFF -DgRPC_BUILD_CODEGEN=OFF -DgRPC_INSTALL=OFF \
  -DgRPC_{ABSL,CARES,PROTOBUF,RE2,SSL,ZLIB}_PROVIDER=package -DProtobuf_PROTOC_LIBRARY="$libraries/libprotobuf.so"
build onetbb-*/ tbb -DTBB_TEST=OFF -DTBB_STRICT=OFF
mkdir -p lib
find build-all build-grpc++ build-tbb -name 'lib*.so.*' -exec cp -a {} lib/ \;
touch lib/done
