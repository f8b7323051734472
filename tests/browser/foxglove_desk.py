"""A folder from which Foxglove Studio opens a recorded trial: for `make foxglove-check`.

`python -m tests.browser.foxglove_desk LOG DIR` leaves the log, a page around Foxglove's packages, and what the page is
to show. The packages are npm's: @foxglove/studio-base, react and react-dom, beside the page in node_modules.
"""

import json
import shutil
import sys
from pathlib import Path

from palpate.adapters.log.reader import read_log
from palpate.adapters.log.schema import message_class

LAYOUT = Path(__file__).parents[2] / "docs/how-to/foxglove-layout.json"
PAGE = """<!doctype html>
<html><head><meta charset="utf-8"><title>palpate</title>
<style>html, body, #root { height: 100%; width: 100%; margin: 0; overflow: hidden }</style></head>
<body><div id="root"></div>
<script>window.global = window; window.process = {env: {NODE_ENV: "production"}};</script>
<script src="node_modules/react/umd/react.production.min.js"></script>
<script src="node_modules/react-dom/umd/react-dom.production.min.js"></script>
<script>window["react"] = React; window["react-dom"] = ReactDOM;</script>
<script src="node_modules/@foxglove/studio-base/assets/index.js"></script>
<script>
const data = LAYOUT;
const layout = {id: "palpate", name: "palpate", permission: "CREATOR_WRITE", baseline: {data, savedAt: undefined}};
const layoutStorage = {
  list: async () => [layout], get: async () => layout, put: async (space, changed) => changed, delete: async () => {},
  importLayouts: async () => {},
};
const settings = {"colorScheme": "light", "timezone": "UTC", "telemetry.telemetryEnabled": false};
const appConfiguration = {
  get: key => settings[key], set: async () => {}, addChangeListener() {}, removeChangeListener() {},
};
localStorage.setItem("studio.profile-data", JSON.stringify({currentLayoutId: "palpate"}));
const log = encodeURIComponent(new URL("trial.mcap", location.href).href);
(async () => {
  await window.initI18n();
  ReactDOM.render(React.createElement(window.App, {
    deepLinks: [`${location.origin}/?ds=remote-file&ds.url=${log}&layoutId=palpate`], appConfiguration, layoutStorage,
    dataSources: [new window.RemoteDataSourceFactory()], extensionLoaders: [], enableGlobalCss: true,
  }), document.getElementById("root"));
})();
</script></body></html>
"""


def main() -> None:
    """Make the folder."""
    source, desk = Path(sys.argv[1]), Path(sys.argv[2])
    desk.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(source, desk / "trial.mcap")
    (desk / "index.html").write_text(PAGE.replace("LAYOUT", LAYOUT.read_text()))
    tick_class = message_class("Tick")
    ticks = [
        {
            "time_ns": tick.time_ns,
            "sequence": tick.wrench.sequence,
            "force_N": list(tick.wrench.force_N),
            "torque_Nm": list(tick.wrench.torque_Nm),
        }
        for tick in map(tick_class.FromString, read_log(source).ticks)
    ]
    topics = ["/call", "/decision", "/end", "/event", "/recorder", "/reinforcement", "/start", "/tick"]
    (desk / "expected.json").write_text(json.dumps({"topics": topics, "ticks": ticks}))


if __name__ == "__main__":
    main()
