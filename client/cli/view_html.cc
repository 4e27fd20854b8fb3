#include <fmt/format.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <string_view>

#include "client/cli/view.h"

namespace stance {
namespace {

// WebGL 1 with one flat-shaded program; one camera for all canvases. The meshes are normalised here: each is
// centred and scaled to the height of its own bounding box.
constexpr std::string_view kPageHead = R"html(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>Stance</title><style>
body{margin:0;font:15px sans-serif;background:#f4f4f2;color:#333;display:flex;height:100vh}
figure{flex:1;margin:0;display:flex;flex-direction:column;min-width:0}
canvas{flex:1;min-height:0;width:100%;cursor:grab;touch-action:none}
figcaption{text-align:center;padding:.6em}
</style></head><body><script>
const meshes = )html";

constexpr std::string_view kPageTail = R"html(;
const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0));
const camera = {yaw: 0.35, pitch: 0.08, zoom: 1};
const colors = [[.55,.66,.80],[.83,.73,.58],[.58,.76,.62]];
const vertexShader = `attribute vec3 p; varying vec3 e; uniform vec4 view; uniform float aspect;
void main() { vec2 s = sin(view.xy), c = cos(view.xy);
  vec3 a = vec3(c.x*p.x - s.x*p.z, p.y, s.x*p.x + c.x*p.z);
  e = vec3(a.x, c.y*a.y - s.y*a.z, s.y*a.y + c.y*a.z);
  gl_Position = vec4(e.x*view.z/aspect, e.y*view.z, -e.z*0.3, 1.0); }`;
const fragmentShader = `#extension GL_OES_standard_derivatives : enable
precision highp float; varying vec3 e; uniform vec3 color;
void main() { vec3 n = normalize(cross(dFdx(e), dFdy(e)));
  float light = 0.35 + 0.65*abs(dot(n, normalize(vec3(0.3, 0.5, 0.8))));
  gl_FragColor = vec4(color*light, 1.0); }`;
const draws = meshes.map((mesh, index) => {
  const figure = document.body.appendChild(document.createElement('figure'));
  const canvas = figure.appendChild(document.createElement('canvas'));
  figure.appendChild(document.createElement('figcaption')).textContent = mesh.caption;
  const gl = canvas.getContext('webgl');
  gl.getExtension('OES_standard_derivatives'); gl.getExtension('OES_element_index_uint');
  const program = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertexShader], [gl.FRAGMENT_SHADER, fragmentShader]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text); gl.compileShader(shader); gl.attachShader(program, shader);
  }
  gl.linkProgram(program); gl.useProgram(program); gl.enable(gl.DEPTH_TEST);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, bytes(mesh.positions), gl.STATIC_DRAW);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, bytes(mesh.indices), gl.STATIC_DRAW);
  const place = gl.getAttribLocation(program, 'p');
  gl.enableVertexAttribArray(place); gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 0, 0);
  const uniform = name => gl.getUniformLocation(program, name);
  gl.uniform3fv(uniform('color'), colors[index % colors.length]);
  const view = uniform('view'), aspect = uniform('aspect');
  return () => {
    const scale = window.devicePixelRatio || 1;
    canvas.width = canvas.clientWidth*scale; canvas.height = canvas.clientHeight*scale;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(.957, .957, .949, 1); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.uniform4f(view, camera.yaw, camera.pitch, camera.zoom, 0);
    gl.uniform1f(aspect, canvas.width/canvas.height);
    gl.drawElements(gl.TRIANGLES, mesh.index_count, gl.UNSIGNED_INT, 0);
  };
});
const draw = () => draws.forEach(one => one());
addEventListener('pointermove', event => { if (!event.buttons) return;
  camera.yaw -= event.movementX*0.01; camera.pitch += event.movementY*0.01; draw(); });
addEventListener('wheel', event => { camera.zoom *= Math.exp(-event.deltaY*0.001); draw(); });
addEventListener('resize', draw); draw();
</script></body></html>
)html";

std::string Base64(std::string_view bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t group = 0;
    for (size_t k = 0; k < 3; ++k) {
      group = group << 8 | (i + k < bytes.size() ? static_cast<uint8_t>(bytes[i + k]) : 0u);
    }
    for (size_t k = 0; k < 4; ++k) {
      text += i + k <= bytes.size() ? kDigits[group >> (18 - 6 * k) & 63] : '=';
    }
  }
  return text;
}

template <typename Matrix>
std::string Base64Of(const Matrix& matrix) {
  return Base64(
      {reinterpret_cast<const char*>(matrix.data()), matrix.size() * sizeof(typename Matrix::Scalar)});
}

// Into [-0.9, 0.9] along the longest side.
Points Centered(Points points) {
  const Eigen::RowVector3f low = points.colwise().minCoeff();
  const Eigen::RowVector3f high = points.colwise().maxCoeff();
  const float side = (high - low).maxCoeff();
  points.rowwise() -= (low + high) / 2;
  return points * (side > 0 ? 1.8f / side : 1.0f);
}

}  // namespace

std::string ViewHtml(const std::vector<ViewItem>& items) {
  nlohmann::json meshes = nlohmann::json::array();
  for (const ViewItem& item : items) {
    meshes.push_back({{"caption", item.caption},
                      {"positions", Base64Of(Centered(UprightPoints(item.mesh->positions, item.up)))},
                      {"indices", Base64Of(item.mesh->faces)},
                      {"index_count", 3 * item.mesh->face_count()}});
  }
  std::string json = meshes.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  // A caption must not be able to end the script.
  for (size_t at = 0; (at = json.find("</", at)) != std::string::npos; at += 3) json.replace(at, 2, "<\\/");
  return fmt::format("{}{}{}", kPageHead, json, kPageTail);
}

}  // namespace stance
