"""Masks that were written beside the true ones, image by image."""
import glob
import os

import cv2
import numpy


class Masks:
    def __init__(self):
        self.overlaps, self.covered, self.areas, self.shares = [], [], [], []

    def __len__(self):
        return len(self.overlaps)

    def mean_overlap(self):
        """Intersection over union."""
        return numpy.mean(self.overlaps)

    def mean_covered(self):
        """Of the true mask, the share that the written one has."""
        return numpy.mean(self.covered)

    def mean_area(self):
        """Of the written mask, in areas of the true one."""
        return numpy.mean(self.areas)

    def mean_share(self):
        """Of the image that is in the written mask."""
        return numpy.mean(self.shares)


def compare_masks(written, true):
    """Of the images that have both; where the true one is empty there is nothing to compare."""
    masks = Masks()
    for path in sorted(glob.glob(os.path.join(written, "*.png"))):
        found = cv2.imread(path, cv2.IMREAD_GRAYSCALE) > 0
        truth = cv2.imread(os.path.join(true, os.path.basename(path)), cv2.IMREAD_GRAYSCALE) > 0
        if truth.any():
            both = (found & truth).sum()
            masks.overlaps.append(both / (found | truth).sum())
            masks.covered.append(both / truth.sum())
            masks.areas.append(found.sum() / truth.sum())
            masks.shares.append(found.mean())
    return masks
