#!/bin/sh
# Make everything that a run needs: system libraries, a virtual environment, Python packages.
#
#   sh resources/setup.sh run|test|check
#
# Installs missing Debian/Ubuntu packages when it runs as root, else prints the line to run and stops.
set -eu

stage=${1:-run}
venv=${VENV:-.venv}
cd "$(dirname "$0")/.."
PATH=$PATH:/usr/sbin:/sbin

say() { printf '%s\n' "$*" >&2; }

# The first interpreter that is new enough; PYTHON=... overrides.
find_python() {
    for name in ${PYTHON:-} python3 python3.13 python3.12 python3.11; do
        if command -v "$name" >/dev/null 2>&1 &&
            "$name" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info < (3, 14))' 2>/dev/null
        then
            command -v "$name"
            return
        fi
    done
}

# Shared libraries that Qt's xcb plugin, VTK and pymeshlab load, and the Debian package of each.
libraries() {
    cat <<LIST
libglib-2.0.so.0 libglib2.0-0
libEGL.so.1 libegl1
libGL.so.1 libgl1
libOpenGL.so.0 libopengl0
libxkbcommon.so.0 libxkbcommon0
libfontconfig.so.1 libfontconfig1
libdbus-1.so.3 libdbus-1-3
libXcursor.so.1 libxcursor1
libxcb-cursor.so.0 libxcb-cursor0
libxcb-icccm.so.4 libxcb-icccm4
libxcb-keysyms.so.1 libxcb-keysyms1
libxcb-shape.so.0 libxcb-shape0
libxkbcommon-x11.so.0 libxkbcommon-x11-0
libcom_err.so.2 libcom-err2
LIST
}

missing_libraries() {
    known=$(ldconfig -p 2>/dev/null || true)
    libraries | while read -r soname package; do
        case "$known" in *"$soname "*) ;; *) printf '%s\n' "$package" ;; esac
    done
}

missing_programs() {
    [ "$stage" = run ] && return
    command -v Xvfb >/dev/null 2>&1 && command -v xvfb-run >/dev/null 2>&1 || echo xvfb
    command -v xauth >/dev/null 2>&1 || echo xauth
}

missing_python() {
    python=$(find_python)
    if [ -z "$python" ]; then
        echo python3 python3-venv
    elif [ ! -x "$venv/bin/python" ] && ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
        case "$python" in
            */python3) echo python3-venv ;;
            *) echo "$(basename "$python")-venv" ;;
        esac
    fi
}

# Debian 13 and Ubuntu 24.04 renamed some libraries when time_t became 64 bits wide.
current_name() {
    if apt-cache show "$1t64" >/dev/null 2>&1; then echo "$1t64"; else echo "$1"; fi
}

install_system_packages() {
    wanted=$(missing_python; missing_libraries; missing_programs)
    [ -n "$wanted" ] || return 0
    if ! command -v apt-get >/dev/null 2>&1; then
        say "This system lacks what these Debian packages hold; install its own equivalents:"
        say "   " $wanted
        exit 1
    fi
    if [ "$(id -u)" -ne 0 ]; then
        names=$(for package in $wanted; do current_name "$package"; done)
        say "Some system packages are missing. Run this line, then try again:"
        say "   sudo apt-get install -y --no-install-recommends" $names
        exit 1
    fi
    say "Installing system packages:" $wanted
    export DEBIAN_FRONTEND=noninteractive
    apt-get update -q </dev/null >&2
    names=$(for package in $wanted; do current_name "$package"; done)
    # shellcheck disable=SC2086
    apt-get install -q -y --no-install-recommends $names </dev/null >&2
    python=$(find_python)
    if [ -z "$python" ]; then
        say "This system's Python is older than 3.11. Install Python 3.11, 3.12 or 3.13 and name it:"
        say "   make run PYTHON=python3.12"
        exit 1
    fi
}

install_python_packages() {
    case "$stage" in
        run) target=. ;;
        test) target='.[test,batch]' ;;
        check) target='.[test,batch,dev]' ;;
        *) say "Unknown stage: $stage (run, test or check)"; exit 2 ;;
    esac
    [ -x "$venv/bin/python" ] || "$(find_python)" -m venv "$venv"
    say "Installing Python packages into $venv (the first time takes a minute or two)"
    pip() { "$venv/bin/python" -m pip --disable-pip-version-check "$@" </dev/null >&2; }
    # The build back end comes from the constraints too, so nothing unpinned is fetched.
    pip install -q -c constraints.txt setuptools
    pip install -q -c constraints.txt --no-build-isolation -e "$target"
}

if [ "$(uname -s)" = Linux ]; then install_system_packages; fi
install_python_packages
mkdir -p "$venv/ready"
touch "$venv/ready/$stage"
