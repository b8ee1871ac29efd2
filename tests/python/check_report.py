"""Pages of 'vdbfrac report' in headless Chromium: no console error, nothing from the network, frames and fragments as the
.obj files have them, something to see, picking as rays that numpy follows, curves, a wedge's table.

Usage: check_report.py PROGRAM SOURCE_FOLDER RUN_FOLDER: of a run of the demo's scene. Exits with 77 where Chromium, ChromeDriver or
Selenium are not installed.
"""
import json
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

try:
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service
    from selenium.webdriver.common.by import By
    from selenium.webdriver.support.ui import WebDriverWait
except ImportError:
    print("skipped: Selenium is not installed (python3-selenium)")
    sys.exit(77)
if missing := [p for p in ("chromium", "chromedriver") if not shutil.which(p)]:
    print(f"skipped: {' and '.join(missing)} not installed (chromium, chromium-driver)")
    sys.exit(77)

from obj_frames import read_obj
from ply_frames import read_ply

FLAGS = ("--headless --no-sandbox --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --disable-quic --no-first-run "
         "--disable-background-networking --disable-component-update --disable-sync --disable-dev-shm-usage --window-size=1200,1000").split()
MOST_BYTES = 15e6  # of the demo's page
MOST_SECONDS = 5   # until it shows its last frame
failures = []


def check(name, holds, told=""):
    if not holds:
        failures.append(f"{name}: {told}")


def tool(program, *arguments):
    return subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, timeout=300)


def browser(folder):
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium")
    for flag in (*FLAGS, f"--user-data-dir={folder}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    return webdriver.Chrome(service=Service(shutil.which("chromedriver")), options=options)


def opened(driver, page):
    """Opens a page; the seconds until it is ready."""
    began = time.monotonic()
    driver.get(f"file://{page}")
    WebDriverWait(driver, 60).until(lambda d: d.execute_script("return !!window.vdbfracReport && window.vdbfracReport.ready"))
    return time.monotonic() - began


def quiet(name, driver):
    """Nothing on the console, nothing fetched."""
    if said := [e["message"] for e in driver.get_log("browser") if e["level"] in ("SEVERE", "WARNING") and "GPU stall" not in e["message"]]:
        failures.append(f"{name}: on the console: {said}")
    fetched = driver.execute_script("return performance.getEntriesByType('resource').map(e => e.name).filter(n => !n.startsWith('data:') && !n.startsWith('blob:'))")
    check(name, not fetched, f"fetched {fetched}")


def frames_of(run):
    manifest = json.loads((run / "run.json").read_text())
    return [(f["frame"], run / w["path"]) for f in manifest["frames"] for w in f["files"] if w["path"].endswith(".obj")]


def surface(path):
    """Points, triangles, and the fragment of each, from the objects' names."""
    fragments, at = [], 0
    for line in path.read_text().splitlines():
        if line.startswith("o "):
            at = int(line.split("_")[-1])
        elif line.startswith("f "):
            fragments += [at] * (len(line.split()) - 3)
    mesh = read_obj(path)
    faces = np.array([(c[0], c[k], c[k + 1]) for line in path.read_text().splitlines() if line.startswith("f ")
                      for c in [[int(w.split("/")[0]) - 1 for w in line.split()[1:]]] for k in range(1, len(c) - 1)])
    return mesh.points, faces, np.array(fragments)


def hit_of(origin, direction, points, triangles):
    """The first triangle that a ray meets, or None (Moeller and Trumbore 1997)."""
    a, u, v = points[triangles[:, 0]], points[triangles[:, 1]] - points[triangles[:, 0]], points[triangles[:, 2]] - points[triangles[:, 0]]
    p = np.cross(direction, v)
    det = (u * p).sum(1)
    det[det == 0] = np.nan
    s = origin - a
    q = np.cross(s, u)
    b, c, t = (s * p).sum(1) / det, q @ direction / det, (v * q).sum(1) / det
    inside = (b >= 0) & (c >= 0) & (b + c <= 1) & (t > 0)
    return int(np.where(inside, t, np.inf).argmin()) if inside.any() else None


def picture_of(driver):
    """Of the player's picture: the share of pixels that are as its corner is, and how many colours there are."""
    return driver.execute_script("""
        const from = vdbfracReport.player.canvas, to = document.createElement('canvas');
        [to.width, to.height] = [from.width, from.height];
        const paper = to.getContext('2d');
        paper.drawImage(from, 0, 0);
        const pixels = new Uint32Array(paper.getImageData(0, 0, to.width, to.height).data.buffer);
        return [pixels.filter(p => p === pixels[0]).length / pixels.length, new Set(pixels).size];""")


def show(driver, index):
    wrong = driver.execute_async_script("""
        const done = arguments[1];
        vdbfracReport.player.show(arguments[0]).then(() => done(null), e => done(String(e)));""", index)
    check(f"frame {index}", wrong is None, wrong)


def check_surface(driver, index, path):
    """The player's triangles are those of the file, to half a step of 16 bits."""
    show(driver, index)
    shown = np.array(driver.execute_script("return Array.from(vdbfracReport.player.geometry.attributes.position.array)")).reshape(-1, 3)
    points, triangles, _ = surface(path)
    expected = points[triangles].reshape(-1, 3)
    check(f"frame {index}", shown.shape == expected.shape, f"{shown.shape} corners, the file has {expected.shape}")
    if shown.shape == expected.shape:
        size = np.array(driver.execute_script("return vdbfracReport.player.data.high.map((h, k) => h - vdbfracReport.player.data.low[k])"))
        off = (np.abs(shown - expected) / size).max() * 65535
        check(f"frame {index}", off < .6, f"points are off by {off} steps")


def check_picking(driver, path):
    """Clicks over the whole picture choose the fragments that rays meet first."""
    camera = driver.execute_script("""
        const p = vdbfracReport.player, b = p.canvas.getBoundingClientRect();
        return {world: p.camera.matrixWorld.elements, inverse: p.camera.projectionMatrixInverse.elements,
                box: [b.left, b.top, b.width, b.height]}""")
    world, inverse = (np.array(camera[k]).reshape(4, 4).T for k in ("world", "inverse"))
    points, triangles, fragments = surface(path)
    left, top, width, height = camera["box"]
    seen, wrong = set(), 0
    for x, y in np.random.default_rng(1).uniform(-.75, .75, (60, 2)):
        far = inverse @ [x, y, .5, 1]
        direction = world[:3, :3] @ (far[:3] / far[3])
        hit = hit_of(world[:3, 3], direction, points, triangles)
        expected = None if hit is None else int(fragments[hit])
        picked = driver.execute_script("return vdbfracReport.player.pick(arguments[0], arguments[1])",
                                       left + (x + 1) / 2 * width, top + (1 - y) / 2 * height)
        seen.add(expected), (picked == expected) or (wrong := wrong + 1)
    check("picking", wrong <= 1, f"{wrong} of 60 places choose another fragment than the ray meets")  # one at a silhouette
    check("picking", None in seen and len(seen) > 2, f"the places meet only {seen}")


def check_run(program, driver, run, folder):
    page = folder / "demo.html"
    said = tool(program, "report", run, "-o", page)
    check("report", said.returncode == 0, said.stderr)
    size, seconds = page.stat().st_size, opened(driver, page)
    print(f"the demo's page: {size / 1e6:.2f} MB, shown after {seconds:.2f} s")
    check("size", size < MOST_BYTES, f"{size} bytes")
    check("opening", seconds < MOST_SECONDS, f"{seconds} s")
    files = frames_of(run)
    count = driver.execute_script("return vdbfracReport.frameCount")
    check("frames", count == len(files), f"{count}, the run has {len(files)}")
    for index in {0, len(files) // 2, len(files) - 1}:
        check_surface(driver, index, files[index][1])
    show(driver, len(files) - 1)
    same, colours = picture_of(driver)
    check("picture", .2 < same < .97 and colours > 100, f"{same:.0%} of it as its corner, {colours} colours")
    check_picking(driver, files[-1][1])
    curves = [c.get_attribute("d") for c in driver.find_elements(By.CSS_SELECTOR, "path.curve")]
    check("curves", len(curves) > 8 and not any("NaN" in d for d in curves), f"{len(curves)} curves")
    titles = [h.text for h in driver.find_elements(By.CSS_SELECTOR, "h2")]
    for title in ("Summary", "Time by stage", "Fragments", "Loads on grips [N]", "Energies [J]", "Scene, with all defaults"):
        check("sections", title in titles, f"no '{title}' in {titles}")
    check_controls(driver, len(files))
    check_values(driver, run, files, len(files) // 8)
    driver.save_screenshot(str(folder / "demo.png"))
    quiet("the demo's page", driver)


RAMP = ["0d0887", "6a00a8", "b12a90", "e16462", "fca636", "f0f921"]


def ramp_colour(t):
    """Linear light, as three.js works in."""
    stops = np.array([[int(c[k:k + 2], 16) / 255 for k in (0, 2, 4)] for c in RAMP])
    stops = np.where(stops <= .04045, stops / 12.92, ((stops + .055) / 1.055) ** 2.4)
    return np.stack([np.interp(t, np.linspace(0, 1, len(RAMP)), stops[:, k]) for k in range(3)], axis=-1)


def values_of(path, name):
    names, table, _, _ = read_ply(path)
    return table[:, names.index(name)]


def check_values(driver, run, files, index):
    """Corners have the colours of their points' energies, by the root; where a crack has not come there is none of its time."""
    plys = [path.parent.parent / "ply" / (path.stem + ".ply") for _, path in files]
    _, triangles, _ = surface(files[index][1])
    for name, share in ("energy", np.sqrt), ("arrival", lambda t: t):
        # Energy peaks at the tip of the crack: one value in 200 of a frame may be beyond the end of the scale.
        high = max((v := np.sort(values_of(p, name)))[-1 - (len(v) // 200 if name == "energy" else 0)] for p in plys)
        low = 0 if name == "energy" else min(v[v >= 0].min(initial=high) for v in (values_of(p, name) for p in plys))  # the first that tore
        value = values_of(plys[index], name)[triangles].reshape(-1)
        expected = np.where(value[:, None] < 0, ((0x8a / 255 + .055) / 1.055) ** 2.4, ramp_colour(share(np.clip((value - low) / (high - low), 0, 1))))
        driver.execute_script("const s = document.querySelector('.bar select'); s.value = arguments[0]; s.dispatchEvent(new Event('change'))", name)
        show(driver, index)
        shown = np.array(driver.execute_script("return Array.from(vdbfracReport.player.geometry.attributes.color.array)")).reshape(-1, 3)
        off = np.abs(shown - expected).max() if shown.shape == expected.shape else shown.shape
        check(f"colours by {name}", off < .02, off)  # 254 codes; grey is not quite grey
        legend = driver.find_element(By.CSS_SELECTOR, ".ramp").text.replace("\n", " ")
        told = [float(w) for w in legend.split() if w[:1].isdigit()]
        check(f"legend of {name}", len(told) == 2 and abs(told[0] - low) <= .01 * high and abs(told[1] / high - 1) < .01, f"'{legend}', the ends are {low} and {high}")


def check_controls(driver, count):
    """The slider, playing, and colours of fragments."""
    frame = lambda: driver.execute_script("return vdbfracReport.player.frame")
    driver.execute_script("const s = document.querySelector('.bar input'); s.value = 0; s.dispatchEvent(new Event('input'))")
    WebDriverWait(driver, 20).until(lambda d: frame() == 0)
    play = driver.find_element(By.CSS_SELECTOR, ".bar button")
    play.click()
    WebDriverWait(driver, 30).until(lambda d: frame() >= min(3, count - 1))
    play.click()
    before = picture_of(driver)[1]
    driver.execute_script("const s = document.querySelector('.bar select'); s.value = 'fragment'; s.dispatchEvent(new Event('change'))")
    check("colours of fragments", picture_of(driver)[1] != before, "the picture does not change")


def check_wedge(program, source, driver, folder):
    """Runs that are compared, and one that has not begun."""
    wedge = folder / "wedge"
    said = tool(program, "wedge", source / "data/scenes/bar.toml", "--local", "-o", wedge, "--vary", "material.rubber.youngs_modulus=5e4,2e5",
                "--set", "time.frames=[1, 4]", "-q")
    check("wedge", said.returncode == 0, said.stderr)
    opened(driver, wedge / "report.html")
    cells = [[c.text for c in r.find_elements(By.XPATH, "./*")] for r in driver.find_elements(By.CSS_SELECTOR, "table tr")]
    check("table", [r[:2] for r in cells] == [["Run", "material.rubber.youngs_modulus"], ["0000", "5e4"], ["0001", "2e5"]], cells)
    check("pictures", len(driver.find_elements(By.CSS_SELECTOR, "figure img")) == 2, "not two")
    quiet("the wedge's page", driver)
    driver.find_element(By.LINK_TEXT, "0001").click()
    WebDriverWait(driver, 60).until(lambda d: d.execute_script("return !!window.vdbfracReport && vdbfracReport.kind == 'run' && vdbfracReport.ready"))
    quiet("a run's page", driver)


def main(program, source, run):
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        driver = browser(folder / "profile")
        try:
            driver.set_script_timeout(60)
            check_run(program, driver, run, folder)
            check_wedge(program, source, driver, folder)
        finally:
            driver.quit()
            print("\n".join(failures) or "pages are as they should be")


main(sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3]).absolute())
sys.exit(1 if failures else 0)
