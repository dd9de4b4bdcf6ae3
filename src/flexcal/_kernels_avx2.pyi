from flexcal._kernels import RuntimeRobot as RuntimeRobot
from flexcal._kernels import Tree as Tree
from flexcal._kernels import closed_loop as closed_loop
from flexcal._kernels import scatter_covariance as scatter_covariance
from flexcal._kernels import update as update
