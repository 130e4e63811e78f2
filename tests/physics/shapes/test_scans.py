"""Labelmaps of scans: the mesh lies where the voxels are, keeps their volumes, and is one at interfaces."""

import struct
from pathlib import Path

import numpy as np
import pytest
import SimpleITK

from palpate.errors import FileFormatError, UsageError
from palpate.physics import ImportedScan
from palpate.physics.advice import ModelWarning
from palpate.physics.shapes.label_surface import label_surface
from palpate.physics.shapes.labelled_mesh import UPWARDS, turn_upwards
from palpate.physics.shapes.scan_file import LabelImage, clear_specks, name_labels, read_scan
from scanned import INNER, OUTER, UP, ball_in_ball, write_labels, write_series

NAMES = {"fat": 1, "lump": 2}
SIDES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


def turn(angle):
    """Return a rotation (3, 3) about a skew axis."""
    x, y, z = np.array([0.36, 0.48, 0.8])
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


@pytest.fixture(scope="module")
def scan(tmp_path_factory):
    return ImportedScan(ball_in_ball(tmp_path_factory.mktemp("scan") / "balls.nrrd"), NAMES, element=4e-3)


class TestMesh:
    def test_tissues_keep_the_volume_of_their_voxels(self, scan):
        voxels = clear_specks(name_labels(scan.path, read_scan(scan.path), NAMES)).volumes
        for name, volume in scan.rest().region_volumes.items():
            assert volume == pytest.approx(voxels[name], rel=0.03)

    def test_tissues_share_the_nodes_between_them(self, scan):
        mesh = scan.rest()
        faces = np.sort(mesh.tetrahedra[:, SIDES].reshape(-1, 3), axis=1)
        region = np.repeat(mesh.region_of, 4)
        _, inverse, count = np.unique(faces, axis=0, return_inverse=True, return_counts=True)
        assert set(count.tolist()) == {1, 2}
        # the outer surface is closed and belongs to fat alone: what bounds the lump bounds fat, too
        assert set(region[count[inverse.ravel()] == 1].tolist()) == {mesh.regions.index("fat")}
        assert mesh.surfaces == ("fat surface",)
        assert mesh.area_vectors.sum(axis=0) == pytest.approx(0, abs=1e-12)

    def test_the_interface_lies_on_the_ball(self, scan):
        mesh = scan.rest()
        both = np.intersect1d(*(mesh.tetrahedra[mesh.region_of == k] for k in (0, 1)))
        away = np.linalg.norm(mesh.points[both] - [0, 0, 1e-3 * UP], axis=1) - 1e-3 * INNER
        assert np.sqrt((away**2).mean()) < 0.5e-3  # a quarter of a voxel
        outer = np.linalg.norm(mesh.points[np.unique(mesh.triangles)], axis=1) - 1e-3 * OUTER
        assert np.sqrt((outer**2).mean()) < 0.5e-3

    @pytest.mark.parametrize("shift", [(0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.3, -0.7, 0.4)])
    def test_terraces_leave_a_ball_round_where_it_faces_an_axis(self, shift):
        voxel = 2.0  # mm
        places = voxel * (np.moveaxis(np.indices((26, 26, 26)), 0, -1) - 12.5) - shift
        labels = (np.linalg.norm(places, axis=-1) < OUTER).astype(int)
        origin = 1e-3 * (np.full(3, -12.5 * voxel) - shift)
        image = LabelImage(labels, np.full(3, 1e-3 * voxel), np.eye(3), origin, {"fat": 1})
        surface = label_surface(image, 2.5e-3)
        centres = 1e3 * surface.points[surface.triangles].mean(axis=1)
        outside = np.linalg.norm(centres, axis=1) - OUTER
        counted = (3 * voxel**3 * labels.sum() / (4 * np.pi)) ** (
            1 / 3
        ) - OUTER  # what the voxels say of its radius
        for axis in (*np.eye(3), *-np.eye(3)):  # under as much of a pole as a ball touches
            near = np.linalg.norm(centres - OUTER * axis, axis=1) < 0.15 * OUTER
            assert abs(outside[near].mean() - counted) < voxel / 16

    def test_the_same_file_gives_the_same_mesh(self, scan):
        again = ImportedScan(scan.path, (("fat", 1), ("lump", 2)), 4e-3)
        assert again == scan
        assert np.array_equal(again.rest().points, scan.rest().points)

    @pytest.mark.parametrize("name", ["balls.mhd", "balls.nhdr"])
    def test_voxels_in_a_file_beside_the_header_are_of_the_content(self, tmp_path, name):
        first = ImportedScan(ball_in_ball(tmp_path / name), NAMES).digest
        (voxels,) = (file for file in tmp_path.iterdir() if file.name != name)
        content = bytearray(voxels.read_bytes())
        content[-1] ^= 1
        voxels.write_bytes(content)
        assert ImportedScan(str(tmp_path / name), NAMES).digest != first


class TestPlaces:
    @pytest.mark.parametrize(
        ("name", "spacing", "axes"),
        [
            ("oblique.nii.gz", (1.5, 2.0, 3.0), turn(0.7)),
            ("mirrored.mha", (2.0, 2.0, 2.0), np.diag([1.0, -1.0, 1.0])),
            ("swapped.nrrd", (2.0, 1.5, 2.5), np.eye(3)[[2, 0, 1]]),
        ],
    )
    def test_anisotropic_and_oblique_voxels_lie_where_their_header_says(self, tmp_path, name, spacing, axes):
        path = str(ball_in_ball(tmp_path / name, spacing, axes))
        surface = label_surface(name_labels(path, read_scan(path), NAMES), 2.5e-3)
        corners = surface.points[surface.triangles]
        flow = np.einsum("ti,ti->t", np.cross(corners[:, 0], corners[:, 1]), corners[:, 2]) / 6
        for number, radius, centre in ((1, OUTER, 0.0), (2, INNER, UP)):
            mine = surface.outside == 0 if number == 1 else (surface.inside == 2) | (surface.outside == 2)
            sign = np.where(surface.inside[mine] == number, 1.0, -1.0)
            volume = (flow[mine] * sign).sum()  # positive: triangles face outwards
            assert volume == pytest.approx(4 / 3 * np.pi * (1e-3 * radius) ** 3, rel=0.03)
            middle = (corners[mine].mean(axis=1) * (flow[mine] * sign)[:, None]).sum(axis=0) * 0.75 / volume
            assert middle == pytest.approx([0, 0, 1e-3 * centre], abs=0.3e-3)

    def test_any_direction_of_the_patient_can_point_up(self, scan):
        for up, direction in UPWARDS.items():
            image = LabelImage(
                np.ones((2, 2, 2), int), np.ones(3), np.eye(3), np.array(direction), {"all": 1}
            )
            turned = turn_upwards(image, up)
            assert turned.origin == pytest.approx([0, 0, 1])
            assert turned.axes.T @ turned.axes == pytest.approx(np.eye(3))
            assert np.linalg.det(turned.axes) == pytest.approx(1)


class TestSeries:
    @pytest.fixture
    def oblique(self, tmp_path):
        path = ball_in_ball(tmp_path / "balls.nrrd", (1.5, 2.0, 3.0), turn(0.7))
        return path, write_series(tmp_path / "series", path)

    def test_a_folder_and_a_slice_in_it_are_the_volume_with_its_oblique_axes(self, oblique):
        path, folder = oblique
        (folder / "reports").mkdir()
        volume = read_scan(str(path))
        for name in (folder, next(folder.glob("*.dcm"))):
            series = read_scan(str(name))
            assert np.array_equal(series.labels, volume.labels)
            assert series.spacing == pytest.approx(volume.spacing, rel=1e-6)
            assert series.axes == pytest.approx(volume.axes, abs=1e-6)
            assert series.origin == pytest.approx(volume.origin, abs=1e-8)

    def test_the_content_of_all_slices_is_that_of_the_body(self, oblique):
        folder = oblique[1]
        first = ImportedScan(str(folder), NAMES).digest
        (folder / "021.dcm").unlink()
        assert ImportedScan(str(folder), NAMES).digest != first

    def test_a_missing_slice_is_said_with_its_place_in_mm(self, oblique):
        (oblique[1] / "035.dcm").unlink()
        with pytest.raises(UsageError, match="not evenly spaced") as error:
            read_scan(str(oblique[1]))
        assert "028.dcm to 042.dcm" in error.value.why
        assert "6 mm, and 3 mm between others" in error.value.why

    def test_a_folder_of_two_series_or_none_is_refused(self, oblique, tmp_path):
        (tmp_path / "empty").mkdir()
        with pytest.raises(UsageError, match="holds no DICOM series"):
            read_scan(str(tmp_path / "empty"))
        piece = SimpleITK.ReadImage(str(next(oblique[1].iterdir())))
        piece.SetMetaData("0020|000e", "1.2.3.5")
        SimpleITK.WriteImage(piece, str(oblique[1] / "other.dcm"))
        with pytest.raises(UsageError, match="holds 2 DICOM series"):
            read_scan(str(oblique[1]))


def test_two_placements_of_a_nifti_header_that_differ_are_told_in_mm_and_voxels(tmp_path):
    path = ball_in_ball(tmp_path / "balls.nii", (1.5, 2.0, 3.0), turn(0.7))
    assert read_scan(str(path)).notes == ()
    header = bytearray(path.read_bytes())
    (across,) = struct.unpack_from("<f", header, 268)  # qoffset_x
    struct.pack_into("<f", header, 268, across + 6.0)
    path.write_bytes(header)
    (note,) = read_scan(str(path)).notes
    assert "6 mm (4 voxels) apart" in note


@pytest.fixture(scope="module")
def half_ball(tmp_path_factory):
    """Return the mesh of half a ball of fat of 24 mm in a skin of 1.5 mm, cut by the end of the image."""
    places = np.moveaxis(np.indices((54, 54, 30)), 0, -1) - [26.5, 26.5, -0.5]
    away = np.linalg.norm(places, axis=-1)
    labels = np.where(away < 22.5, 1, np.where(away < 24.0, 2, 0))
    path = write_labels(tmp_path_factory.mktemp("skin") / "half.nrrd", labels.astype(np.uint8))
    with pytest.warns(ModelWarning, match="one layer of flat elements"):
        mesh = ImportedScan(path, {"fat": 1, "skin": 2}, element=5e-3).rest()
    return mesh, {name: 1e-9 * (labels == k).sum() for name, k in (("fat", 1), ("skin", 2))}


class TestThinLayers:
    @pytest.mark.parametrize(("layers", "element"), [(1, 1.4e-3), (2, 2.8e-3)])
    def test_a_skin_of_few_voxels_stays_whole_where_elements_are_as_small(self, layers, element):
        reach, voxel = 8, 2.0  # voxels; mm
        away = np.linalg.norm(np.indices((22, 22, 22)) - 10.5, axis=0)
        labels = np.where(away < reach - layers, 1, np.where(away < reach, 2, 0))
        image = LabelImage(labels, np.full(3, 1e-3 * voxel), np.eye(3), np.zeros(3), {"fat": 1, "skin": 2})
        surface = label_surface(image, element)
        outer = surface.outside == 0
        assert set(surface.inside[outer].tolist()) == {2}  # fat shows nowhere
        corners = surface.points[surface.triangles]
        flow = np.einsum("ti,ti->t", np.cross(corners[:, 0], corners[:, 1]), corners[:, 2]) / 6
        volume = flow[surface.inside == 2].sum() - flow[surface.outside == 2].sum()
        assert volume == pytest.approx(image.volumes["skin"], rel=0.005)

    def test_a_skin_thinner_than_an_element_keeps_its_volume_and_covers_the_body(self, half_ball):
        mesh, voxels = half_ball
        assert mesh.region_volumes == pytest.approx(voxels, rel=0.03)
        assert set(mesh.surfaces) == {"skin surface", "cut"}  # fat shows at the cut alone
        assert mesh.areas["skin surface"] == pytest.approx(2 * np.pi * 0.024**2, rel=0.05)
        assert mesh.areas["cut"] == pytest.approx(np.pi * 0.024**2, rel=0.15)  # its rim is round

    def test_such_a_skin_is_as_high_as_its_voxels_everywhere_and_no_element_is_inside_out(self, half_ball):
        mesh, _ = half_ball
        corners = np.unique(mesh.triangles[mesh.surface_of == mesh.surfaces.index("skin surface")])
        places = mesh.points[corners] - [26.5e-3, 26.5e-3, -0.5e-3]
        away = np.linalg.norm(places[places[:, 2] > 5e-3], axis=1)  # an element from the rim of the cut
        assert np.sqrt(((away - 0.024) ** 2).mean()) < 0.25e-3  # a quarter of a voxel
        edges = mesh.points[mesh.tetrahedra[:, 1:]] - mesh.points[mesh.tetrahedra[:, :1]]
        assert (np.linalg.det(edges) > 0).all()
        # one body: each face belongs to two elements or to the surface
        faces = np.sort(mesh.tetrahedra[:, SIDES].reshape(-1, 3), axis=1)
        _, count = np.unique(faces, axis=0, return_counts=True)
        assert set(count.tolist()) == {1, 2}
        assert (count == 1).sum() == len(mesh.triangles)


class TestRepairs:
    def image(self, labels, names=NAMES):
        return LabelImage(np.asarray(labels), np.full(3, 1e-3), np.eye(3), np.zeros(3), names)

    def test_specks_and_pinholes_take_what_surrounds_them_and_are_told(self):
        labels = np.zeros((12, 12, 12), int)
        labels[2:10, 2:10, 2:10] = 1
        whole = labels.copy()
        labels[5, 5, 5], labels[0, 0, 0], labels[7, 7, 7] = 0, 1, 2
        labels[3:5, 3:5, 3:6] = 2
        whole[3:5, 3:5, 3:6] = 2
        cleared = clear_specks(self.image(labels))
        assert np.array_equal(cleared.labels, whole)
        assert [note.partition("(")[0] for note in cleared.notes] == [
            "1 specks of 'fat' ",
            "1 specks of 'lump' ",
            "1 pinholes ",
        ]

    def test_islands_and_holes_are_kept_and_told_in_voxels_and_mm(self):
        labels = np.zeros((16, 12, 12), int)
        labels[1:11, 1:11, 1:11] = 1
        labels[13:15, 2:4, 2:5] = 1
        labels[4:7, 4:7, 4:7] = 0
        cleared = clear_specks(self.image(labels, {"fat": 1}))
        assert np.array_equal(cleared.labels, labels)
        assert "12 voxels, 12 mm³" in cleared.notes[0]
        assert "27 voxels, 27 mm³" in cleared.notes[1]

    def test_labels_without_a_name_are_left_out_and_told(self, scan):
        image = name_labels(scan.path, read_scan(scan.path), {"fat": 1})
        assert set(np.unique(image.labels).tolist()) == {0, 1}
        assert "label 2" in image.notes[0]

    def test_a_body_that_is_cut_by_the_image_says_where(self, tmp_path):
        labels = np.zeros((14, 14, 12), np.uint8)
        labels[2:12, 2:12, :8] = 1
        path = write_labels(tmp_path / "cut.nrrd", labels, (2, 2, 2))
        with pytest.warns(ModelWarning, match="end of the image"):
            mesh = ImportedScan(path, {"fat": 1}, element=4e-3).rest()
        assert mesh.areas["cut"] == pytest.approx(0.02**2, rel=0.15)


class TestRefusals:
    @pytest.mark.parametrize(
        ("labels", "spacing", "words"),
        [
            (np.zeros((4, 4, 4), np.uint8), (1, 1, 1), "is empty"),
            (np.ones((4, 4, 4, 2), np.uint8), (1, 1, 1, 1), "has 4 dimensions"),
            (np.ones((4, 4), np.uint8), (1, 1), "is a plane"),
            (np.arange(512, dtype=np.int16).reshape(8, 8, 8), (1, 1, 1), "is no labelmap"),
            (np.full((4, 4, 4), 0.5, np.float32), (1, 1, 1), "is no labelmap"),
        ],
    )
    def test_what_is_no_labelmap_is_said(self, tmp_path, labels, spacing, words):
        path = str(write_labels(tmp_path / "scan.nrrd", labels, spacing))
        with pytest.raises(UsageError, match=words):
            name_labels(path, read_scan(path), {})

    def test_colours_are_refused(self, tmp_path):
        image = SimpleITK.GetImageFromArray(np.ones((4, 4, 4, 3), np.uint8), isVector=True)
        SimpleITK.WriteImage(image, str(tmp_path / "rgb.mha"))
        with pytest.raises(UsageError, match="3 numbers for each voxel"):
            read_scan(str(tmp_path / "rgb.mha"))

    def test_an_empty_label_is_named_with_those_that_there_are(self, scan):
        with pytest.raises(UsageError, match="skin=3 is empty") as error:
            name_labels(scan.path, read_scan(scan.path), {"fat": 1, "skin": 3})
        assert "2 (" in error.value.why

    def test_a_file_without_the_size_of_a_voxel_is_refused(self, tmp_path):
        head = b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 4 4\nencoding: raw\n\n"
        (tmp_path / "bare.nrrd").write_bytes(head + bytes(64))
        with pytest.raises(UsageError, match="does not state the size of its voxels"):
            read_scan(str(tmp_path / "bare.nrrd"))

    def test_a_damaged_file_is_refused(self, tmp_path, scan):
        (tmp_path / "short.nrrd").write_bytes(Path(scan.path).read_bytes()[:400])
        with pytest.raises(FileFormatError, match=r"short\.nrrd"):
            read_scan(str(tmp_path / "short.nrrd"))

    def test_a_layer_that_the_elements_would_lose_is_refused_by_its_volume(self, tmp_path):
        labels = np.zeros((40, 40, 40), np.uint8)
        labels[5:35, 5:35, 5:35] = 1
        labels[11:29, 11:29, 11:29] = 2
        labels[12:28, 12:28, 12:28] = 1
        path = write_labels(tmp_path / "thin.nrrd", labels)
        with pytest.raises(UsageError, match="too large for 'lump'") as error:
            ImportedScan(path, NAMES, element=6e-3).rest()
        assert "1.74 ml in the voxels" in error.value.why

    def test_two_names_of_one_number_are_refused(self, scan):
        with pytest.raises(UsageError, match="share a name or a number"):
            ImportedScan(scan.path, {"fat": 1, "gland": 1})
