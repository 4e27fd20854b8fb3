#!/usr/bin/env bash
# From a bare Debian to a transferred pose: installs what is needed, builds, starts a server with the bundled
# models, gives one bundled character the pose of another by the default method through the gRPC client, and stops
# the server.
#
#   deploy/quickstart.sh [--no-install] [SOURCE REFERENCE]
#
# Writes out/target.obj, out/target.glb and out/view.png. MODEL_DIR names another folder of a model or of models.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

install=1
meshes=()
for argument in "$@"; do
  case "$argument" in
    -h | --help)
      usage
      exit 0
      ;;
    --no-install) install=0 ;;
    -*) die "unknown option $argument" ;;
    /*) meshes+=("$argument") ;;
    *) meshes+=("$called_from/$argument") ;;
  esac
done
if ((${#meshes[@]} == 0)); then meshes=(deploy/sample/source.glb deploy/sample/reference.glb); fi
((${#meshes[@]} == 2)) || die "wants SOURCE and REFERENCE, or neither"
model="${MODEL_DIR:-models}"
[[ "$model" == /* || -z "${MODEL_DIR:-}" ]] || model="$called_from/$model"
for file in "${meshes[@]}" "$model"; do
  [[ -r "$file" ]] || die "$file: no such file"
done

if ((install)); then deploy/install-deps.sh; fi

say "build (the first time takes several minutes)"
configure_release
cmake --build --preset release --parallel "$(build_jobs)" --target stance-server stance
bin="$root/build/release/bin"
out="$root/out"
mkdir -p "$out"

say "start the server with $model"
server_pid=
# The server's own exit status says whether it finished all that it had accepted.
stop_server() {
  local pid="$server_pid"
  server_pid=
  [[ -n "$pid" ]] || return 0
  kill -TERM "$pid" 2>/dev/null || true
  wait "$pid"
}
trap 'stop_server || true' EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

# Port 0: the system chooses a free one, and the server says which.
: > "$out/server.out"
"$bin/stance-server" --listen 127.0.0.1:0 --metrics-listen 127.0.0.1:0 --log-format text \
  --model "$model" \
  > "$out/server.out" 2> "$out/server.log" &
server_pid=$!

address=
deadline=$((SECONDS + 120))
until [[ -n "$address" ]] && "$bin/stance" server-info --server "$address" --timeout 5 > /dev/null 2>&1; do
  if ! kill -0 "$server_pid" 2>/dev/null; then
    cat "$out/server.out" "$out/server.log" >&2
    die "the server ended before it was ready"
  fi
  ((SECONDS < deadline)) || die "the server is not ready after 120 s; see $out/server.log"
  sleep 0.2
  address="$(sed -n 's/^listening on //p' "$out/server.out" | head -n 1)"
done
say "ready at $address"

# The twist is that of METHOD_SKELETAL; METHOD_STANCE, the default where its model is there, learns its own.
"$bin/stance" transfer "${meshes[@]}" --server "$address" \
  --output "$out/target.obj" --output "$out/target.glb" --view "$out/view.png"

say "stop the server"
stop_server || die "the server did not stop cleanly; see $out/server.log"

say "done"
cat <<END
  source     ${meshes[0]}
  reference  ${meshes[1]}
  target     $out/target.obj, $out/target.glb
  picture    $out/view.png (source, reference, target)
  server log $out/server.log
END
