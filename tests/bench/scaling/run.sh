#!/usr/bin/env bash
# Cost against texels, triangles, size and lights; see scaling.py --help and README.md.
set -euo pipefail
exec /usr/bin/python3 "$(dirname "${BASH_SOURCE[0]}")/scaling.py" "$@"
