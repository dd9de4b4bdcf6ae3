from flexcal._kernels import RuntimeRobot as RuntimeRobot
from flexcal._kernels import Tree as Tree
from flexcal._kernels import add_selected as add_selected
from flexcal._kernels import closed_loop as closed_loop
from flexcal._kernels import scatter_covariance as scatter_covariance
from flexcal._kernels import triangular_inverse as triangular_inverse
from flexcal._kernels import update as update
