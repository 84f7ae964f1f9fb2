#!/usr/bin/env bash
# Errors on levels that nobody tuned on; see unseen.py --help and README.md.
set -euo pipefail
exec /usr/bin/python3 "$(dirname "${BASH_SOURCE[0]}")/unseen.py" "$@"
