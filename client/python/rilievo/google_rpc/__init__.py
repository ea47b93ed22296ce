"""google.rpc.Status and its details: those of googleapis-common-protos where that is installed,
since a process can hold one description of them only, else the ones generated here."""
try:
    from google.rpc import error_details_pb2, status_pb2
except ImportError:
    from .generated import error_details_pb2, status_pb2

__all__ = ["error_details_pb2", "status_pb2"]
