#!/usr/bin/env bash
# Tests passgraph in a fresh Debian: sudo bash tests/machines.sh debian12|debian13|testing [arguments for tests/run.sh]
#
# Makes a root with mmdebstrap (apt-get install mmdebstrap) from the committed state of this checkout, installs there as
# a user does, and writes what was seen into docs/machines.json, and docs/machines.md from it. The commands of README.md
# run first, then the conformance suite (--quick) of each backend, a video, the viewer in Chromium and each extra.
# It takes an hour on two cores, 15 minutes with --quick. Certificates, proxies and settings of apt and pip are those
# of this machine. Processes and mounts of the root end with the script.
#
#   KEEP    a folder: the root stays there, with what each step printed in root/root/steps (default: a temporary folder,
#           removed at the end). From a root that is there it goes on: with the newest commit, and the steps that have not
#           passed yet
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# Steps in the root, each with its result: of a check passed or failed; of a count the last line, after failed if so.
inside() {
    mkdir -p /root/steps
    cd /root/passgraph
    touch /root/results
    note() {
        sed -i "/^$1\t/d" /root/results
        printf '%s\t%s\n' "$1" "$2" | tee -a /root/results
    }
    run() { timeout 14400 "${@:2}" </dev/null >"/root/steps/$1" 2>&1; }
    passed() { grep "^$1"$'\t' /root/results | grep -qv failed; }
    check() {
        if passed "$1"; then return; fi
        if run "$@"; then note "$1" passed; else note "$1" failed; fi
    }
    count() {
        local failed=''
        if passed "$1"; then return; fi
        run "$@" || failed='failed: '
        note "$1" "$failed$(grep -v '^ *$' "/root/steps/$1" | tail -n 1 | sed -E 's/^[= ]+//; s/^[a-z]+: //; s/ in [0-9.]+s.*//')"
    }
    version() { dpkg-query -W -f='${Version}' "$1" 2>/dev/null | sed -E 's/^[0-9]+://; s/[-+~].*//'; }
    read_video() {
        .venv/bin/passgraph apply docs/shaders/dissolve.glsl docs/images/soft-shadow.png --to docs/images/soft-shadow.png \
            --progress 0..1 --frames 5 -o /root/fade.mp4 && .venv/bin/passgraph apply black-and-white /root/fade.mp4 -o /root/gray.mp4
    }

    if passed "first command"; then
        .venv/bin/pip install --quiet --no-input --no-deps --force-reinstall .  # the commit is newer than what is there
    fi
    check "first command" bash -c "$(sed -n 's/^\(python3 -m venv .*\)/\1/p' README.md)"
    count "second command" bash tests/run.sh "$@"
    note options "${*:-none}"
    note system "$(. /etc/os-release && echo "$PRETTY_NAME")"
    note python "$(python3 -c 'import platform; print(platform.python_version())')"
    note mesa "$(version libgl1-mesa-dri)"
    note pocl "$(version pocl-opencl-icd)"
    note chromium "$(version chromium)"
    for extra in $(.venv-tests/bin/python docs/machines.py --extras); do
        check "extra $extra" .venv/bin/pip install --no-input ".[$extra]"
    done
    note "without a wheel" "$(.venv-tests/bin/python docs/machines.py --without-wheel)"
    for backend in numpy gl opencl webgpu; do
        count "conform $backend" .venv/bin/passgraph conform --backend "$backend" --quick
    done
    export -f read_video
    check video bash -ec read_video
    count viewer .venv-tests/bin/python -m pytest -q tests/viewer/test_page.py
}

case "${1-}" in
    inside) inside "${@:2}"; exit ;;
    debian12) suite=bookworm ;;
    debian13) suite=trixie ;;
    testing) suite=testing ;;
    *) sed -n '2p' "$0" | cut -c 3-; exit 2 ;;
esac
name=$1
[ "$(id -u)" -eq 0 ] || { echo "tests/machines.sh: it makes a root, so run it as root" >&2; exit 2; }
command -v mmdebstrap >/dev/null || { echo "tests/machines.sh: no mmdebstrap here; run: apt-get install mmdebstrap" >&2; exit 2; }

folder=${KEEP:-$(mktemp -d)}
[ -n "${KEEP-}" ] || trap 'rm -rf --one-file-system "$folder"' EXIT
root=$folder/root
mkdir -p "$folder"
apt-config dump | grep -E '^Acquire::(https?|Retries|Check-)' >"$folder/apt.conf" || true
if [ ! -d "$root/root/passgraph" ]; then
    mmdebstrap --variant=minbase --aptopt="$folder/apt.conf" --include=ca-certificates,git,python3,python3-venv "$suite" "$root"
    # As files: links lead out of the root.
    for path in /etc/resolv.conf /etc/hosts /etc/ssl/certs /etc/pip.conf /etc/xdg/pip "$HOME/.config/pip"; do
        [ ! -e "$path" ] || tar -ch --ignore-failed-read "$path" 2>/dev/null | tar -x -C "$root"
    done
    git clone -q --no-local . "$root/root/passgraph"
fi
git -C "$root/root/passgraph" fetch -q "$PWD" HEAD
git -C "$root/root/passgraph" checkout -q FETCH_HEAD
mapfile -t settings < <(env | grep -iE '^(pip_|ssl_cert|(http|https|no|all)_proxy=|requests_ca|curl_ca)')

# A mount and process namespace of its own: nothing has to be undone.
unshare --mount --pid --fork --kill-child bash -ec '
    mount --rbind /dev "$0/dev" && mount -t proc proc "$0/proc" && mount --rbind /sys "$0/sys"
    exec chroot "$0" env -i HOME=/root LANG=C.UTF-8 PATH=/usr/sbin:/usr/bin:/sbin:/bin "$@"
' "$root" "${settings[@]}" bash /root/passgraph/tests/machines.sh inside "${@:2}"

python3 docs/machines.py --row "$name" "$root/root/results"
! grep -q failed "$root/root/results"
