#!/usr/bin/env bash
# Installs the renderers that Nephroid is charted against, as far as Debian and the Python package index hold them:
# POV-Ray, LuxCore and Mitsuba 3. They go into bench/peers/venv and the system's packages; nothing else is touched.
set -euo pipefail
cd "$(dirname "$0")"
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    apt-get update
    # Mitsuba's vectorised variants need any LLVM from 14 on.
    llvm=$(apt-cache search --names-only '^libllvm1[4-9]$' | cut -d' ' -f1 | sort | tail -1)
    apt-get install -y --no-install-recommends povray python3-venv ${llvm:+"$llvm"}
else
    echo "install.sh: not root on Debian: povray, python3-venv and libllvm are expected to be there" >&2
fi
[ -d venv ] || python3 -m venv venv
venv/bin/pip install --quiet numpy OpenEXR mitsuba pyluxcore
venv/bin/pip freeze | grep -iE '^(mitsuba|pyluxcore|OpenEXR|numpy)='
(command -v povray >/dev/null && povray --version 2>&1 | head -1) || true
