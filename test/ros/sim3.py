"""Sim(3) alignment of two trajectories, for tests."""
import numpy


def rotation_matrix(q):
    """Of a quaternion x y z w."""
    x, y, z, w = numpy.asarray(q, float) / numpy.linalg.norm(q)
    return numpy.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def angle_deg(rotation):
    return numpy.degrees(numpy.arccos(numpy.clip((numpy.trace(rotation) - 1) / 2, -1, 1)))


def umeyama(source, target):
    """scale, rotation, translation with target = scale * rotation * source + translation, points in rows (1991)."""
    mean_source, mean_target = source.mean(0), target.mean(0)
    centred_source, centred_target = source - mean_source, target - mean_target
    u, d, vt = numpy.linalg.svd(centred_target.T @ centred_source / len(source))
    s = numpy.diag([1, 1, numpy.linalg.det(u) * numpy.linalg.det(vt)])
    rotation = u @ s @ vt
    scale = numpy.trace(numpy.diag(d) @ s) / (centred_source ** 2).sum(1).mean()
    return scale, rotation, mean_target - scale * rotation @ mean_source


def mean_rotation(rotations):
    """The rotation nearest to all of these (Frobenius)."""
    u, _, vt = numpy.linalg.svd(sum(rotations))
    return u @ numpy.diag([1, 1, numpy.linalg.det(u @ vt)]) @ vt


def errors(estimate, reference):
    """Both {stamp: (position, quaternion xyzw)}, the estimate's stamps among the reference's. Position RMSE after Sim(3)
    alignment as a share of the path; median angle in degrees between the orientations after the best single rotation;
    and the angle between that rotation and the one that aligns the positions."""
    stamps = sorted(estimate)
    source = numpy.array([estimate[s][0] for s in stamps])
    target = numpy.array([reference[s][0] for s in stamps])
    scale, rotation, translation = umeyama(source, target)
    residuals = target - (scale * source @ rotation.T + translation)
    path = numpy.linalg.norm(numpy.diff(target, axis=0), axis=1).sum()
    turns = [rotation_matrix(reference[s][1]) @ rotation_matrix(estimate[s][1]).T for s in stamps]
    turn = mean_rotation(turns)
    angles = [angle_deg(turn.T @ t) for t in turns]
    return numpy.sqrt((residuals ** 2).sum(1).mean()) / path, numpy.median(angles), angle_deg(turn.T @ rotation)
