"""The undocumented parts of Numba that kernels take: where another version of it may break them.

Each name is here with the parameters by which the package calls it, or None for what it is not called by itself; what
is taken from them is held by test_internals.py.
"""

# Types of functions and operations, and their implementations: trace/values.py, trace/emit.py, arguments.py
TYPING = {
    "core.typing.context.BaseContext.refresh": "self",
    "core.typing.context.BaseContext.resolve_function_type": "self func args kws",
    "core.typing.context.BaseContext.resolve_getattr": "self typ attr",
    "core.typing.context.BaseContext.resolve_value_type": "self val",
    "core.typing.context.BaseContext.unify_types": "self *typelist",
    "core.typing.templates.Signature": "return_type args recvr",
    "core.typing.templates.signature": "return_type *args",
    "core.types.abstract.Literal": None,
    "core.types.functions.BoundFunction": None,
    "core.types.misc.Omitted": None,
    "core.types.containers.StarArgTuple": None,
    "core.types.containers.StarArgUniTuple": None,
    "core.types.containers.BaseTuple.from_types": "tys pyclass",
}
LOWERING = {
    "core.base.BaseContext.cast": "self builder val fromty toty",
    "core.base.BaseContext.get_abi_sizeof": "self ty",
    "core.base.BaseContext.get_constant": "self ty val",
    "core.base.BaseContext.get_constant_generic": "self builder ty val",
    "core.base.BaseContext.get_data_type": "self ty",
    "core.base.BaseContext.get_dummy_value": "self",
    "core.base.BaseContext.get_function": "self fn sig",
    "core.base.BaseContext.get_getattr": "self typ attr",
    "core.base.BaseContext.get_value_type": "self ty",
    "core.cpu.CPUContext.get_ufunc_info": "self ufunc_key",
    "core.base.BaseContext.make_array": "self typ",
    "core.base.BaseContext.make_tuple": "self builder typ values",
    "core.callconv.CPUCallConv.get_function_type": "self restype argtypes",
    "core.callconv.CPUCallConv._get_excinfo_argument": "self func",
    "core.callwrapper.PyCallWrapper": "context module func fndesc env call_helper release_gil",
    "core.callwrapper.PyCallWrapper.build": "self",
    "core.callwrapper.PyCallWrapper.build_wrapper": "self api builder closure args kws",
    "core.cgutils": None,
    "core.cpu.CPUContext.create_cpython_wrapper": "self library fndesc env call_helper release_gil",
    "core.datamodel.registry.default_manager": None,
    "core.imputils.impl_ret_borrowed": "ctx builder retty ret",
    "core.pythonapi.NativeValue": "value is_error cleanup",
    "core.pythonapi.PythonAPI.long_as_longlong": "self numobj",
    "core.pythonapi.PythonAPI.to_native_value": "self typ obj",
    "np.arrayobj.load_item": "context builder arrayty ptr",
    "np.arrayobj.populate_array": "array data shape strides itemsize meminfo",
    "np.arrayobj.store_item": "context builder arrayty val ptr",
    "np.linalg.ensure_blas": "",
    "np.numpy_support.as_dtype": "nbtype",
    "np.numpy_support.ufunc_find_matching_loop": "ufunc arg_types",
}
# Templates that type a call by its trace or else by Numba: trace/helpers.py
TEMPLATES = {
    "core.dispatcher.Dispatcher": None,
    "core.typing.templates._OverloadFunctionTemplate.generic": "self args kws",
    "core.typing.templates._OverloadFunctionTemplate.get_impl_key": "self sig",
    "core.typing.templates.infer": None,
    "core.typing.templates.infer_global": None,
    "core.typing.templates.make_overload_template": "func overload_func jit_options strict inline",
}
# The passes of the compiler and of LLVM: compilers.py
COMPILING = {
    "core.codegen.CPUCodegen._pass_builder": "self **kwargs",
    "core.codegen.JITCodeLibrary": None,
    "core.codegen.JITCodeLibrary._finalize_final_module": "self",
    "core.codegen.JITCodeLibrary._get_module_for_linking": "self",
    "core.codegen.JITCodeLibrary._optimize_final_module": "self",
    "core.codegen.JITCodeLibrary._optimize_functions": "self ll_module",
    "core.codegen.JITCodeLibrary.enable_object_caching": "self",
    "core.codegen.JITCodeLibrary.get_defined_functions": "self",
    "core.codegen.JITCodeLibrary.get_function": "self name",
    "core.codegen.JITCodeLibrary.get_pointer_to_function": "self name",
    "core.compiler.Compiler": None,
    "core.compiler.CompilerBase.compile_extra": "self func",
    "core.compiler.CompilerBase.define_pipelines": "self",
    "core.typed_passes": None,
    "core.untyped_passes": None,
}
# What is compiled, on disk and in this process: cache.py, entries.py, machine_code.py
CACHE = {
    "_dispatcher.compute_fingerprint": None,
    "core.caching.FunctionCache": None,
    "core.caching.FunctionCache._index_key": "self sig codegen",
    "core.caching.FunctionCache.save_overload": "self sig data",
    "core.caching.IndexDataCacheFile": "cache_path filename_base source_stamp",
    "core.caching.IndexDataCacheFile._data_path": "self name",
    "core.caching.IndexDataCacheFile._load_index": "self",
    "core.codegen.JITCPUCodegen.set_env": "self env_name env",
    "core.compiler.CompileResult._find_referenced_environments": "self",
    "core.errors.NumbaError": None,
    "core.errors.TypingError": None,
    "core.errors.UnsupportedBytecodeError": None,
    "core.event": None,
    "core.serialize.NumbaPickler": None,
    "core.sigutils": None,
}
ALL = {**TYPING, **LOWERING, **TEMPLATES, **COMPILING, **CACHE}
