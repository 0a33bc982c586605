"""From a scene to its pixels: `python3 example.py SCENE` beside a coordinator's folder, or with GRADFARM_DATA naming it.

Also holds what the client uses to what the coordinator describes, so it fails where the two do not fit.
"""

import sys

import gradfarm


def check(farm):
    """Every operation of the client is one of the coordinator."""
    paths = farm.openapi()["paths"]
    for name, (method, path) in gradfarm.OPERATIONS.items():
        assert method in paths.get(gradfarm.ROOT + path, {}), f"{name}: the coordinator has no {method} {path}"


def main(scene):
    farm = gradfarm.Farm()
    check(farm)
    job = farm.submit(scene, samples=32, size="48x32", tile=16, seed=7, curve=True)
    for name, data in job.events():
        if name == "progress":
            print(f"{data['samples']['done']} of {data['samples']['total']} samples")
    job.refresh().wait(300)
    assert any(told["id"] == job.id for told in farm.jobs(state="done")), "the list has it"
    print(f"relMSE {job.accuracy()['points'][-1]['relmse']:.2e}, with {len(farm.workers())} workers")
    assert job.png()[1:4] == b"PNG" and job.exr()[:4] == b"\x76\x2f\x31\x01"
    try:
        farm.job("01920d4e-7f3b-7cc1-9f52-0a3e5f3c2b11")
    except gradfarm.Problem as problem:
        assert problem.status == 404, problem
    try:
        image = job.pixels()
    except ModuleNotFoundError:
        print("without NumPy there are no pixels")
        return
    assert image.shape == (32, 48, 3) and image.mean() > 0
    print(f"mean {image.mean():.4f}")


if __name__ == "__main__":
    main(sys.argv[1])
