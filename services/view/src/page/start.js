"use strict";
// `?renderer=webgl` or `webgpu` chooses how to draw.
const canvas = document.getElementById("view");
const notice = document.getElementById("notice");
const options = {
  url: [`rerun+http://127.0.0.1:${canvas.dataset.port}/proxy`],
  render_backend: new URLSearchParams(location.search).get("renderer"),
  hide_welcome_screen: true,
  enable_history: false,
  // The layout is the run's, not what was left of the last one.
  persist: false,
};
wasm_bindgen({ module_or_path: "re_viewer_bg.wasm" })
  .then(() => new wasm_bindgen.WebHandle(options).start(canvas))
  .then(() => notice.remove())
  .catch((error) => { notice.textContent = `The viewer can't be shown: ${error}`; });
