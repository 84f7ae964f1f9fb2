#!/usr/bin/env bash
# Time against error; see converge.py --help.
set -euo pipefail
exec /usr/bin/python3 "$(dirname "${BASH_SOURCE[0]}")/converge.py" "$@"
