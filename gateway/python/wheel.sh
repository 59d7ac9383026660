#!/usr/bin/env bash
# Makes the wheel of a release in the folder that is given: for Python 3.10 and later, on machines like this one.
set -euo pipefail
out=$(mkdir -p "$1" && cd "$1" && pwd)
cd "$(dirname "$0")"

most_bytes=$((30 * 1000 * 1000))
tools=../../target/maturin
if ! command -v maturin >/dev/null; then
    python3 -m venv "$tools" && "$tools/bin/pip" install --quiet 'maturin>=1.9.4,<2'
    PATH=$PWD/$tools/bin:$PATH
fi
rm -f "$out"/tandem_sim-*.whl
maturin build --release --strip --locked --out "$out"
for wheel in "$out"/tandem_sim-*.whl; do
    bytes=$(wc -c <"$wheel")
    echo "$wheel: $bytes bytes"
    [ "$bytes" -le "$most_bytes" ] || { echo "a wheel has at most $most_bytes bytes" >&2; exit 1; }
done
